// SPDX-License-Identifier: Apache-2.0
// Files that a job reads indirectly: the photographs in a folder, and the files that a TOML file names.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace symrig::base {

/// The pictures of a folder. Empty if the folder cannot be read; the code that reads it reports the error.
std::vector<std::filesystem::path> photographs_in(const std::filesystem::path& folder);

/// Regular files that a TOML file names in a string, relative to its own folder. It needs no knowledge of the
/// keys. A string that happens to be the name of a file protects that file, which does no harm.
std::vector<std::filesystem::path> files_named_in(const std::filesystem::path& settings);
/// The same of a text that is in no file; names are relative to `folder`.
std::vector<std::filesystem::path> files_named_in(std::string_view text, const std::filesystem::path& folder);

}  // namespace symrig::base
