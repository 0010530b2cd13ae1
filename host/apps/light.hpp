// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <string>

namespace symrig::apps {

/// Reads `--light`: a picture file, or one of the built-in lights (white, bar, letters, natural) drawn for
/// the grid. Colour becomes its luminance (Rec. 709), because projectors show white light here. Any finite
/// value is allowed: T is linear.  of: what the grid is, for the message. fails: not_found, bad_format,
/// bad_value, size_mismatch (naming both sizes).
Result<Image<float>> read_light(const std::string& light, Grid grid, const std::string& of);

/// Help text on lights.
std::string light_help();

}  // namespace symrig::apps
