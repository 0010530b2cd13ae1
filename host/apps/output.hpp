// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/job_files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/image.hpp"
#include "symrig/report/text.hpp"

#include <cstdint>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace symrig::apps {

/// The eight colours of ECMA-48 that every colour terminal has; the person chooses how they look.
enum class Colour : std::uint8_t { red = 31, yellow = 33, cyan = 36 };

/// May colours go to this descriptor? Only to a terminal, and not if NO_COLOR is set to anything
/// (https://no-color.org), or the terminal is "dumb" or has no name.
bool takes_colours(int descriptor);

/// The text in bold and in a colour. The text must be printable.
std::string coloured(std::string_view text, Colour colour);

using text::byte_size, text::duration, text::grouped, text::percent;

/// Writes text for people to standard output. Control characters are shown, not sent to the terminal
/// (printable()).
/// fails: io (a closed pipe, a full disk).
Result<void> print(std::string_view text);

/// Writes one printable line to standard error: "symrig capture: what; next step".
void print_error(std::string_view command, std::string_view line);

/// Checks that the suffix names a picture format (.exr, .png, .pfm).
/// fails: bad_argument.
Result<void> check_picture_suffix(const std::string& path);
bool is_png(const std::string& path);
bool is_exr(const std::string& path);

/// Writes text unchanged to a file with write_text_output(), or to standard output. An empty path writes
/// nothing.
/// fails: io, not_found.
Result<void> write_text(const std::string& path, std::string_view text);

/// Writes a picture; the suffix chooses the format. EXR and PFM store the values unchanged. PNG is 8-bit sRGB
/// of value × exposure, clipped at 1. facts: go into an EXR header.
/// fails: io, bad_argument.
Result<void> write_picture(const std::string& path, const Image<float>& picture, double exposure,
                           const PictureFacts& facts);

/// JSON as text. Names may contain bytes that are not UTF-8, which JSON does not allow: each becomes U+FFFD.
inline std::string json_text(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace symrig::apps
