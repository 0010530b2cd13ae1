// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <span>
#include <string>
#include <string_view>

namespace symrig {

/// Reads a light: a picture file, or a built-in light drawn on the grid.
/// Colour becomes luminance (Rec. 709), because projectors show white light here. Any finite value is
/// allowed: T is linear.
/// of: what has this grid, for the message. warning: that colour was lost; left alone otherwise.
/// fails: not_found, bad_format, bad_value, size_mismatch (names both sizes).
Result<Image<float>> read_light(const std::string& light, Grid grid, const std::string& of,
                                std::string* warning = nullptr);

/// A light that needs no file.
struct BuiltInLight {
  std::string_view name, meaning;
  Image<float> (*draw)(Grid grid);
};
std::span<const BuiltInLight> built_in_lights();

}  // namespace symrig
