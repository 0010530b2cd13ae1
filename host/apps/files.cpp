// SPDX-License-Identifier: Apache-2.0
#include "files.hpp"

#include "symrig/image/file.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

namespace fs = std::filesystem;

std::string suffix(const std::string& path) {
  std::string text = fs::path(path).extension().string();
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

}  // namespace

Result<void> check_picture_suffix(const std::string& path) {
  if (!has_picture_suffix(path))
    return Error{ErrorCode::bad_argument, fmt::format("{} does not end in .exr, .png or .pfm", path),
                 "give one of these suffixes: it chooses the picture format"};
  return {};
}

bool is_png(const std::string& path) {
  return suffix(path) == ".png";
}

bool is_exr(const std::string& path) {
  return suffix(path) == ".exr";
}

Result<void> write_text(const std::string& path, std::string_view text) {
  return path.empty() ? Result<void>() : write_text_output(path, text);
}

Result<void> write_picture(const std::string& path, const Image<float>& picture, double exposure,
                           const PictureFacts& facts) {
  return is_png(path) ? write_display_png(path, picture, exposure) : write_image(path, picture, facts);
}

}  // namespace symrig::apps
