// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A file descriptor that closes itself; -1: none.
class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  Fd(Fd&& other) noexcept;
  Fd& operator=(Fd&& other) noexcept;
  ~Fd();

  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }
  /// Closes it now. false: the system reports an error, as a full disk may only here. Without one, true.
  bool close();

 private:
  int fd_ = -1;
};

/// Writes a whole file. After it, `path` is either unchanged or complete: it writes a temporary file in the
/// same folder, calls fsync, and renames. It follows a symbolic link, so the link stays a link.
/// fails: not_found (no such folder), io.
Result<void> write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view text);

/// The three steps for writers that make the file themselves.
/// A name beside `target` that no other writer uses.
std::filesystem::path temporary_name(const std::filesystem::path& target);
/// The file that `path` means, at the end of its symbolic links: a regular file, or none yet.
/// fails: not_found (no folder), io (a folder, device, pipe or socket).
Result<std::filesystem::path> replaceable_file(const std::filesystem::path& path);
/// Renames `temporary` to `target`. It only replaces a regular file.
/// fails: as replaceable_file, io.
Result<void> replace_file(const std::filesystem::path& temporary, const std::filesystem::path& target);

/// Checks that a path can be read as a file. It reads nothing, and never opens pipes and devices.
/// fails: not_found; io (permission denied, a folder, not a regular file).
Result<void> check_readable(const std::filesystem::path& path);

/// Reads a whole file.
/// fails: as check_readable; limit (more than max_bytes).
Result<std::vector<std::byte>> read_file(const std::filesystem::path& path,
                                         std::uint64_t max_bytes = std::uint64_t{4} << 30);

/// A program calls this first. It opens /dev/null for each closed descriptor from 0 to 2, so that reading or
/// writing it still fails. Otherwise the next file that the program opens would become its standard output.
void reserve_standard_streams();

/// Reads standard input to its end.
/// fails: io (closed, a folder); limit (more than max_bytes).
Result<std::string> read_standard_input(std::uint64_t max_bytes);

/// Writes the whole text to standard output.
/// fails: io (closed, a full disk).
Result<void> write_standard_output(std::string_view text);

/// Writes to standard error. Ignores errors, because there is nowhere left to report them.
void write_standard_error(std::string_view text);

}  // namespace symrig
