// SPDX-License-Identifier: Apache-2.0
// Files that other files stand for: a folder of photographs, a TOML file that names others.
#pragma once

#include <filesystem>
#include <vector>

namespace symrig::base {

/// The pictures of a folder. Empty where it cannot be read: whoever reads it says why.
std::vector<std::filesystem::path> photographs_in(const std::filesystem::path& folder);

/// Regular files that a TOML file names in a string, from its own folder on. No knowledge of its keys is
/// needed: a string that happens to be the name of a file protects that file, which does no harm.
std::vector<std::filesystem::path> files_named_in(const std::filesystem::path& settings);

}  // namespace symrig::base
