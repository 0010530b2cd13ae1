// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace symrig {

/// Writes a whole file so that `path` is either what it was before or complete: a temporary file in the same
/// folder, fsync, rename. A symbolic link is followed, so that it stays a link.
/// fails: not_found (the folder is not there), io.
Result<void> write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view text);

/// For writers that make the file themselves: a name beside `target` that nobody else has,
std::filesystem::path temporary_name(const std::filesystem::path& target);
/// the file that `path` stands for, behind symbolic links: a regular file, or none yet,
/// fails: not_found (no folder), io (a folder, device, pipe or socket).
Result<std::filesystem::path> replaceable_file(const std::filesystem::path& path);
/// and the rename. Only a regular file is ever replaced.  fails: as replaceable_file, io.
Result<void> replace_file(const std::filesystem::path& temporary, const std::filesystem::path& target);

/// Can it be read as a file? Nothing is read, and pipes and devices are never opened.
/// fails: not_found; io (permission denied, a folder, no regular file).
Result<void> check_readable(const std::filesystem::path& path);

/// Reads a whole file. fails: as check_readable; limit (more than max_bytes).
Result<std::vector<std::byte>> read_file(const std::filesystem::path& path,
                                         std::uint64_t max_bytes = std::uint64_t{4} << 30);

}  // namespace symrig
