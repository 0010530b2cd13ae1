// SPDX-License-Identifier: Apache-2.0

#include "output.hpp"

#include "program.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

namespace symrig::apps {

bool takes_colours(int descriptor) {
  const char* const no_colour = std::getenv("NO_COLOR");
  const char* const terminal = std::getenv("TERM");
  const bool refused = no_colour != nullptr && *no_colour != '\0';
  const bool plain = terminal == nullptr || *terminal == '\0' || std::string_view(terminal) == "dumb";
  return !refused && !plain && isatty(descriptor) == 1;
}

std::string coloured(std::string_view text, Colour colour) {
  return fmt::format("\x1b[1;{}m{}\x1b[0m", static_cast<int>(colour), text);
}

Result<void> print(std::string_view text) {
  return write_standard_output(printable(text));
}

void print_error(std::string_view command, std::string_view line) {
  const std::string head = fmt::format("{}{}{}:", program_name(), command.empty() ? "" : " ", command);
  write_standard_error(fmt::format(
      "{} {}\n", takes_colours(STDERR_FILENO) ? coloured(head, Colour::red) : head, printable_line(line)));
}

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
