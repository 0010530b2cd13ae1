// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <filesystem>
#include <string>

namespace symrig {

/// SHA-256 of a file, as sha256sum prints it.  fails: as read_file.
Result<std::string> file_hash(const std::filesystem::path& path);

}  // namespace symrig
