// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/job_files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/picture_facts.hpp"

#include <string>

#include <nlohmann/json.hpp>

namespace symrig::apps {

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
