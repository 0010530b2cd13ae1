// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

namespace symrig::acquisition {

/// A file that grows at its end and is read anywhere. While it is open, it is locked against other processes:
/// against their writing if this one only reads, and else against all.
/// Reading is thread-safe. Every failure is io and names the file, unless said.
class AppendedFile {
 public:
  /// A new, empty file.  fails: also bad_argument (it is there already), not_found (no folder).
  static Result<AppendedFile> create(const std::filesystem::path& path);
  /// fails: also not_found.
  static Result<AppendedFile> open(const std::filesystem::path& path);
  /// To read only: any number of processes may have it open so, but none while another one may write to it.
  /// fails: also not_found.
  static Result<AppendedFile> open_to_read(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }

  /// Fills `bytes` from `offset` on.  fails: also if the file ends before.
  Result<void> read(std::uint64_t offset, std::span<std::byte> bytes) const;
  /// Adds both at the end in one system call if the system allows. After a failure the file is as before.
  Result<void> append(std::span<const std::byte> first, std::span<const std::byte> second = {});
  /// Forgets what comes after the first `size` bytes.
  Result<void> cut(std::uint64_t size);
  /// Waits until the disk has it.
  Result<void> sync() const;

 private:
  AppendedFile(std::filesystem::path path, int fd) : path_(std::move(path)), fd_(fd) {}
  static Result<AppendedFile> open_as(const std::filesystem::path& path, int access, int lock);
  static Result<AppendedFile> locked(AppendedFile file, int lock);
  Error failure(const char* what) const;

  std::filesystem::path path_;
  Fd fd_;
  std::uint64_t size_ = 0;
};

// The head of a photograph log: what it is, and of which capture (docs/photograph-log.md).

/// The bytes that a log of this capture begins with.
std::vector<std::byte> log_head(const LogIdentity& identity);

/// Whether the file begins with the head of this capture.
enum class HeadState : std::uint8_t {
  whole,
  whole_of_version_1,  ///< its records say nothing of budgets, and must not
  torn,                ///< its writer was killed before the head was complete: no photograph is lost
};
/// fails: bad_format (not a log, a newer version, another capture: the first difference is named), io.
Result<HeadState> check_log_head(const AppendedFile& file, const LogIdentity& identity);

/// A head, whichever capture it is of.
struct FoundHead {
  Grid grid;
  int channels = 1;
  std::uint64_t bytes = 0;                         ///< photographs begin here
  std::shared_ptr<const Image<float>> steps = {};  ///< LogIdentity::steps
};
/// fails: bad_format (not a log, a newer version, damaged), io.
Result<FoundHead> read_log_head(const AppendedFile& file);

}  // namespace symrig::acquisition
