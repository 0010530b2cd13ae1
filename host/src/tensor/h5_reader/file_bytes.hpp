// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace symrig::tensor::h5 {

/// Takes numbers from bytes that nobody has checked. After a step past their end, all is 0 and ok() is false.
class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : left_(bytes) {}

  std::span<const std::uint8_t> take(std::uint64_t size) {
    if (size > left_.size()) {
      ok_ = false;
      left_ = {};
      return {};
    }
    const auto taken = left_.first(static_cast<std::size_t>(size));
    left_ = left_.subspan(taken.size());
    return taken;
  }
  void skip(std::uint64_t size) { take(size); }
  /// A little-endian number of 0 to 8 bytes.
  std::uint64_t number(std::uint64_t size) {
    const auto from = take(size);
    if (from.size() > 8) ok_ = false;
    std::uint64_t value = 0;
    for (std::size_t k = std::min<std::size_t>(from.size(), 8); k-- > 0;) value = value << 8U | from[k];
    return value;
  }
  unsigned byte() { return static_cast<unsigned>(number(1)); }
  /// Takes the signature of a structure. false: there is another one.
  bool signature(std::string_view letters) {
    const auto found = take(letters.size());
    return std::equal(found.begin(), found.end(), letters.begin(), letters.end(),
                      [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); });
  }
  std::span<const std::uint8_t> left() const { return left_; }
  bool ok() const { return ok_; }

 private:
  std::span<const std::uint8_t> left_;
  bool ok_ = true;
};

/// Of HDF5's structures: Jenkins' lookup3 (hashlittle) with the initial value 0.
std::uint32_t lookup3(std::span<const std::uint8_t> bytes);

/// Of the filter fletcher32: sums of 16-bit words, high byte first, modulo 65535.
std::uint32_t fletcher32(std::span<const std::uint8_t> bytes);

// The bytes of an HDF5 file.  source: "HDF5 File Format Specification Version 3.0", The HDF Group.

/// Bytes from the signature of the file on.
using Address = std::uint64_t;
inline constexpr Address kUndefined = ~Address{0};

/// A structure that is not as the format says.  Without a hint, like all errors of this folder: read_file()
/// adds one.
Error damaged_at(std::string_view structure, Address at, std::string_view why);

/// What the head of a file says.
struct Superblock {
  std::uint64_t begin = 0;  ///< of the signature in the file; a block of the user's may be before it
  std::uint64_t end = 0;    ///< of the file, as it was when it was closed
  unsigned address_bytes = 8, length_bytes = 8;
  Address root = kUndefined;
  bool marked = false;  ///< as open for writing
};

/// An open file, which stays as it was opened if another takes its name. Several threads may read it.
class FileBytes {
 public:
  FileBytes(Fd file, std::uint64_t size) : file_(std::move(file)), size_(size) {}

  /// Where the signature of HDF5 is; nothing: it is no such file.
  std::optional<std::uint64_t> find_signature() const;
  /// fails: bad_format.
  Result<void> read_superblock(std::uint64_t begin);
  const Superblock& superblock() const { return head_; }
  /// Of the whole file.
  std::uint64_t size() const { return size_; }

  /// Reads into memory of the caller.  fails: bad_format (outside of the file), io.
  Result<void> read(Address at, std::span<std::uint8_t> to) const;
  Result<std::vector<std::uint8_t>> read(Address at, std::uint64_t size) const;
  /// The same for a structure that ends with its checksum, and without that.
  Result<std::vector<std::uint8_t>> read_checked(std::string_view structure, Address at,
                                                 std::uint64_t size) const;

  Address address(Bytes& bytes) const;
  std::uint64_t length(Bytes& bytes) const { return bytes.number(head_.length_bytes); }

 private:
  Result<void> read_old_superblock(Bytes bytes, unsigned version);
  Result<void> read_new_superblock(std::span<const std::uint8_t> all, unsigned version);

  Fd file_;
  std::uint64_t size_;
  Superblock head_;
};

}  // namespace symrig::tensor::h5
