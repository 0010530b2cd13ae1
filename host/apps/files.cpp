// SPDX-License-Identifier: Apache-2.0
#include "files.hpp"

#include "console.hpp"
#include "symrig/base/atomic_file.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

namespace symrig::apps {
namespace {

namespace fs = std::filesystem;

std::string suffix(const std::string& path) {
  std::string text = fs::path(path).extension().string();
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

fs::path folder_of(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

}  // namespace

Result<void> check_output(const std::string& path) {
  if (path.empty() || path == "-") return {};
  std::error_code error;
  const fs::path folder = folder_of(path);
  if (!fs::is_directory(folder, error))
    return Error{ErrorCode::not_found,
                 fmt::format("{} cannot be written: there is no folder {}", path, folder.string()),
                 "make it, or give another place"};
  if (fs::is_directory(path, error))
    return Error{ErrorCode::io, fmt::format("{} cannot be written: it is a folder", path),
                 "give a file name"};
  if (access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return Error{ErrorCode::io,
               fmt::format("{} cannot be written: {} ({})", path, folder.string(), std::strerror(errno)),
               "give a folder that you may write to"};
}

Result<void> check_picture_output(const std::string& path) {
  constexpr std::array<std::string_view, 3> kSuffixes{".exr", ".png", ".pfm"};
  if (std::find(kSuffixes.begin(), kSuffixes.end(), suffix(path)) == kSuffixes.end())
    return Error{ErrorCode::bad_argument, fmt::format("{} does not end in .exr, .png or .pfm", path),
                 "the suffix says which kind of picture to write"};
  return check_output(path);
}

bool is_png(const std::string& path) {
  return suffix(path) == ".png";
}

Result<void> write_text(const std::string& path, std::string_view text) {
  if (path.empty()) return {};
  if (path == "-") return print(text);
  return write_file_atomically(path, text);
}

Result<void> write_picture(const std::string& path, const Image<float>& picture, double exposure) {
  return is_png(path) ? write_display_png(path, picture, exposure) : write_image(path, picture);
}

}  // namespace symrig::apps
