// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/checksum.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

namespace symrig::tensor::h5 {
namespace {

struct Lookup3 {
  std::uint32_t a, b, c;

  void add(std::span<const std::uint8_t> bytes) {
    std::array<std::uint32_t, 3> words{};
    for (std::size_t k = 0; k < bytes.size(); ++k)
      words[k / 4] |= std::uint32_t{bytes[k]} << static_cast<unsigned>(k % 4 * 8);
    a += words[0], b += words[1], c += words[2];
  }
  void mix() {
    a -= c, a ^= std::rotl(c, 4), c += b;
    b -= a, b ^= std::rotl(a, 6), a += c;
    c -= b, c ^= std::rotl(b, 8), b += a;
    a -= c, a ^= std::rotl(c, 16), c += b;
    b -= a, b ^= std::rotl(a, 19), a += c;
    c -= b, c ^= std::rotl(b, 4), b += a;
  }
  void finish() {
    c ^= b, c -= std::rotl(b, 14);
    a ^= c, a -= std::rotl(c, 11);
    b ^= a, b -= std::rotl(a, 25);
    c ^= b, c -= std::rotl(b, 16);
    a ^= c, a -= std::rotl(c, 4);
    b ^= a, b -= std::rotl(a, 14);
    c ^= b, c -= std::rotl(b, 24);
  }
};

/// Modulo 65535; the rest of a multiple is 65535, not 0.
std::uint32_t folded(std::uint64_t sum) {
  while (sum > 0xFFFFU) sum = (sum & 0xFFFFU) + (sum >> 16U);
  return static_cast<std::uint32_t>(sum);
}

/// The sums of the words, and of these sums, so far.
struct Fletcher {
  std::uint64_t sum = 0, sum_of_sums = 0;

  void add(std::uint32_t word) {
    sum += word;
    sum_of_sums += sum;
  }
};

/// Eight words at a time, which a processor adds at once. Word k of turn i is in the sums of all words from
/// there on: 8 (turns - i) - k times.
constexpr std::size_t kLanes = 8;
void add_turns(std::span<const std::uint8_t> bytes, std::size_t turns, Fletcher& all) {
  std::array<std::uint32_t, kLanes> sums{}, totals{};
  for (std::size_t turn = 0; turn < turns; ++turn) {
    std::array<std::uint16_t, kLanes> words;
    std::memcpy(words.data(), bytes.data() + turn * sizeof words, sizeof words);
    for (std::size_t k = 0; k < kLanes; ++k) {
      sums[k] += static_cast<std::uint16_t>(words[k] << 8U | words[k] >> 8U);  // high byte first
      totals[k] += sums[k];
    }
  }
  all.sum_of_sums += turns * kLanes * all.sum;
  for (std::size_t k = 0; k < kLanes; ++k) {
    all.sum_of_sums += kLanes * std::uint64_t{totals[k]} - k * std::uint64_t{sums[k]};
    all.sum += sums[k];
  }
}

}  // namespace

std::uint32_t lookup3(std::span<const std::uint8_t> bytes) {
  const auto start = 0xDEADBEEFU + static_cast<std::uint32_t>(bytes.size());
  Lookup3 state{start, start, start};
  for (; bytes.size() > 12; bytes = bytes.subspan(12)) {
    state.add(bytes.first(12));
    state.mix();
  }
  if (bytes.empty()) return state.c;
  state.add(bytes);
  state.finish();
  return state.c;
}

std::uint32_t fletcher32(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kTurnBytes = 2 * kLanes, kMostTurns = 256;  // totals of more do not fit into 32 bits
  Fletcher all;
  while (bytes.size() >= kTurnBytes) {
    const std::size_t turns = std::min(bytes.size() / kTurnBytes, kMostTurns);
    add_turns(bytes, turns, all);
    all = {folded(all.sum), folded(all.sum_of_sums)};
    bytes = bytes.subspan(turns * kTurnBytes);
  }
  for (; bytes.size() > 1; bytes = bytes.subspan(2)) all.add(std::uint32_t{bytes[0]} << 8U | bytes[1]);
  if (!bytes.empty()) all.add(std::uint32_t{bytes[0]} << 8U);
  return folded(all.sum_of_sums) << 16U | folded(all.sum);
}

}  // namespace symrig::tensor::h5
