// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/file_bytes.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include <fmt/format.h>
#include <unistd.h>

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

namespace {

constexpr std::string_view kSignature("\x89HDF\r\n\x1A\n", 8);
constexpr std::uint64_t kLargestSuperblock = 128;

bool possible_width(unsigned bytes) {
  return bytes == 2 || bytes == 4 || bytes == 8;
}

}  // namespace

Error damaged_at(std::string_view structure, Address at, std::string_view why) {
  const bool is_vowel = structure.find_first_of("aeio") == 0;
  return {ErrorCode::bad_format,
          fmt::format("has {} {} at byte {} that {}", is_vowel ? "an" : "a", structure, at, why), ""};
}

std::optional<std::uint64_t> FileBytes::find_signature() const {
  for (std::uint64_t at = 0; at < size_; at = at == 0 ? 512 : 2 * at) {
    const auto found = read(at, kSignature.size());
    if (!found) return std::nullopt;
    if (Bytes(*found).signature(kSignature)) return at;
  }
  return std::nullopt;
}

Result<void> FileBytes::read_superblock(std::uint64_t begin) {
  SYMRIG_TRY(const auto all, read(begin, std::min(size_ - begin, kLargestSuperblock)));
  Bytes bytes(all);
  bytes.skip(kSignature.size());
  const unsigned version = bytes.byte();
  if (version > 3)
    return Error{ErrorCode::bad_format,
                 fmt::format("is an HDF5 file of version {}, newer than this program", version)};
  head_.begin = begin;
  SYMRIG_CHECK(version < 2 ? read_old_superblock(bytes, version) : read_new_superblock(all, version));
  if (head_.end > size_ - begin || head_.root >= head_.end)
    return damaged_at("superblock", 0, "does not fit the size of the file");
  return {};
}

Result<void> FileBytes::read_old_superblock(Bytes bytes, unsigned version) {
  bytes.skip(4);  // versions of its parts
  head_.address_bytes = bytes.byte();
  head_.length_bytes = bytes.byte();
  if (!possible_width(head_.address_bytes) || !possible_width(head_.length_bytes))
    return damaged_at("superblock", 0, "is damaged");
  bytes.skip(version == 0 ? 9 : 13);  // sizes of the nodes of trees, which the nodes state too
  const std::uint64_t base = address(bytes);
  bytes.skip(head_.address_bytes);
  const std::uint64_t end = address(bytes);
  bytes.skip(std::uint64_t{2} * head_.address_bytes);  // of a driver; of the root's name
  head_.root = address(bytes);
  if (!bytes.ok() || end < base) return damaged_at("superblock", 0, "is damaged");
  head_.end = end - base;
  return {};
}

Result<void> FileBytes::read_new_superblock(std::span<const std::uint8_t> all, unsigned version) {
  Bytes bytes(all);
  bytes.skip(kSignature.size() + 1);
  head_.address_bytes = bytes.byte();
  head_.length_bytes = bytes.byte();
  const unsigned flags = bytes.byte();
  if (!possible_width(head_.address_bytes) || !possible_width(head_.length_bytes))
    return damaged_at("superblock", 0, "is damaged");
  const std::uint64_t base = address(bytes);
  bytes.skip(head_.address_bytes);  // of an extension
  const std::uint64_t end = address(bytes);
  head_.root = address(bytes);
  const std::size_t used = all.size() - bytes.left().size();
  const auto checksum = static_cast<std::uint32_t>(bytes.number(4));
  if (!bytes.ok() || end < base || lookup3(all.first(used)) != checksum)
    return damaged_at("superblock", 0, "is damaged");
  head_.end = end - base;
  head_.marked = version == 3 && (flags & 5U) != 0;  // 1: writing, 4: writing while others read
  return {};
}

Result<void> FileBytes::read(Address at, std::span<std::uint8_t> to) const {
  const std::uint64_t room = size_ - head_.begin;
  if (at > room || to.size() > room - at)
    return Error{ErrorCode::bad_format, fmt::format("points to byte {}, behind the end of the file", at)};
  for (std::size_t done = 0; done < to.size();) {
    const ::ssize_t count = ::pread(file_.get(), to.data() + done, to.size() - done,
                                    static_cast<::off_t>(head_.begin + at + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0)
      return Error{ErrorCode::io, fmt::format("cannot be read ({})", std::strerror(errno)), "check the disk"};
    if (count == 0) return Error{ErrorCode::bad_format, "became shorter while it was read"};
    done += static_cast<std::size_t>(count);
  }
  return {};
}

Result<std::vector<std::uint8_t>> FileBytes::read(Address at, std::uint64_t size) const {
  if (size > size_)
    return Error{ErrorCode::bad_format, fmt::format("points to byte {}, behind the end of the file", at)};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  SYMRIG_CHECK(read(at, bytes));
  return bytes;
}

Result<std::vector<std::uint8_t>> FileBytes::read_checked(std::string_view structure, Address at,
                                                          std::uint64_t size) const {
  if (size < 4) return damaged_at(structure, at, "is too short");
  SYMRIG_TRY(std::vector<std::uint8_t> bytes, read(at, size));
  const auto content = std::span<const std::uint8_t>(bytes).first(bytes.size() - 4);
  Bytes end(std::span<const std::uint8_t>(bytes).last(4));
  if (lookup3(content) != end.number(4)) return damaged_at(structure, at, "fails its checksum");
  bytes.resize(content.size());
  return bytes;
}

Address FileBytes::address(Bytes& bytes) const {
  const std::uint64_t value = bytes.number(head_.address_bytes);
  const std::uint64_t undefined = ~std::uint64_t{0} >> (64 - 8 * head_.address_bytes);
  return value == undefined ? kUndefined : value;
}

}  // namespace symrig::tensor::h5
