// SPDX-License-Identifier: Apache-2.0
#include "tensor/h5_reader/file_bytes.hpp"

#include "tensor/h5_reader/checksum.hpp"

#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <unistd.h>

namespace symrig::tensor::h5 {
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
