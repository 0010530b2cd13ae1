// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <string>

namespace symrig::apps {

/// Checks before long work that `path` can become a file: its folder exists and takes new files, and it is
/// not a folder itself. "-" and "" always can.  fails: not_found, io.
Result<void> check_output(const std::string& path);

/// The same, and that the suffix names a picture format (.exr, .png, .pfm).  fails: also bad_argument.
Result<void> check_picture_output(const std::string& path);
bool is_png(const std::string& path);

/// Writes text through a temporary file beside `path` and a rename; "-" prints it, "" does nothing.  fails:
/// io.
Result<void> write_text(const std::string& path, std::string_view text);

/// Writes a picture, format by suffix. EXR and PFM hold the values as they are; PNG is 8-bit sRGB of value ×
/// exposure, clipped at 1.  fails: io, bad_argument.
Result<void> write_picture(const std::string& path, const Image<float>& picture, double exposure);

}  // namespace symrig::apps
