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

/// Can it be read as a file? Nothing is read, and a pipe without a writer is not waited for.
/// fails: not_found; io (permission denied, a folder, no regular file).
Result<void> check_readable(const std::filesystem::path& path);

/// Reads a whole file. fails: as check_readable; limit (more than max_bytes).
Result<std::vector<std::byte>> read_file(const std::filesystem::path& path,
                                         std::uint64_t max_bytes = std::uint64_t{4} << 30);

}  // namespace symrig
