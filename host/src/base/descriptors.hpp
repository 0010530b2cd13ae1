// SPDX-License-Identifier: Apache-2.0
// What a path or a descriptor leads to, and how a descriptor is written.
#pragma once

#include "symrig/base/result.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <sys/types.h>

namespace symrig::base {

/// The file at the end of symbolic links, even if it does not exist yet.
std::filesystem::path link_target(const std::filesystem::path& path);

/// The folder that contains a file.
std::filesystem::path folder_of(const std::filesystem::path& path);

/// The descriptor that a path such as /dev/stdout or /dev/fd/3 means; "-" is standard output.
std::optional<int> descriptor_of(const std::filesystem::path& path);

/// The identity of a file: device and inode. A file that does not exist yet has those of its folder, and its
/// name.
struct FilePlace {
  dev_t device = 0;
  ino_t inode = 0;
  mode_t mode = 0;   ///< 0: there is no such file
  std::string name;  ///< set only if the file does not exist

  bool exists() const { return mode != 0; }
  bool regular() const;
  bool operator==(const FilePlace& other) const {
    return device == other.device && inode == other.inode && name == other.name;
  }
};

/// nullopt: neither the file nor its folder exists.
std::optional<FilePlace> place_of(const std::filesystem::path& path);
std::optional<FilePlace> place_of(int descriptor);

/// "a folder", "a device", ...
const char* kind_of(mode_t mode);

/// Writes the whole text.
/// fails: io.
Result<void> write_descriptor(int descriptor, std::string_view text);

}  // namespace symrig::base
