// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/internal/fast_crc32c.hpp"

#include <array>
#include <bit>
#include <cstring>

#if defined(__x86_64__)
#include <nmmintrin.h>
#endif

namespace symrig::acquisition {
namespace {

static_assert(std::endian::native == std::endian::little, "eight bytes are loaded as one little-endian word");

using Table = std::array<std::uint32_t, 256>;

/// kTables[j][b]: what byte b adds to the remainder when 8 − j more bytes follow it in its word.
constexpr std::array<Table, 8> kTables = [] {
  std::array<Table, 8> tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0x82F63B78U : 0U);
    tables[0][byte] = crc;
  }
  for (std::size_t j = 1; j < 8; ++j)
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = tables[j - 1][byte];
      tables[j][byte] = (before >> 8U) ^ tables[0][before & 0xFFU];
    }
  return tables;
}();

std::uint64_t word_at(const std::byte* bytes) {
  std::uint64_t word;
  std::memcpy(&word, bytes, sizeof word);
  return word;
}

std::uint32_t tail(std::uint32_t crc, std::span<const std::byte> bytes) {
  for (const std::byte b : bytes)
    crc = (crc >> 8U) ^ kTables[0][(crc ^ std::to_integer<std::uint32_t>(b)) & 0xFFU];
  return crc;
}

#if defined(__x86_64__)
__attribute__((target("sse4.2"))) std::uint32_t instruction_crc32c(std::span<const std::byte> bytes) {
  std::uint64_t crc = 0xFFFFFFFFU;
  const std::size_t words = bytes.size() / 8;
  for (std::size_t i = 0; i < words; ++i) crc = _mm_crc32_u64(crc, word_at(bytes.data() + 8 * i));
  return ~tail(static_cast<std::uint32_t>(crc), bytes.subspan(8 * words));
}
#endif

}  // namespace

std::uint32_t portable_crc32c(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  const std::size_t words = bytes.size() / 8;
  for (std::size_t i = 0; i < words; ++i) {
    const std::uint64_t word = word_at(bytes.data() + 8 * i) ^ crc;
    crc = 0;
    for (unsigned j = 0; j < 8; ++j) crc ^= kTables[7 - j][(word >> (8 * j)) & 0xFFU];
  }
  return ~tail(crc, bytes.subspan(8 * words));
}

std::uint32_t fast_crc32c(std::span<const std::byte> bytes) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("sse4.2")) return instruction_crc32c(bytes);
#endif
  return portable_crc32c(bytes);
}

}  // namespace symrig::acquisition
