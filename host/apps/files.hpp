// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/job_files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <string>

namespace symrig::apps {

/// That the suffix names a picture format (.exr, .png, .pfm).  fails: bad_argument.
Result<void> check_picture_suffix(const std::string& path);
bool is_png(const std::string& path);

/// Writes text as it is: to a file by write_text_output(), or to standard output; "" does nothing.  fails:
/// io, not_found.
Result<void> write_text(const std::string& path, std::string_view text);

/// Writes a picture, format by suffix. EXR and PFM hold the values as they are; PNG is 8-bit sRGB of value ×
/// exposure, clipped at 1.  fails: io, bad_argument.
Result<void> write_picture(const std::string& path, const Image<float>& picture, double exposure);

}  // namespace symrig::apps
