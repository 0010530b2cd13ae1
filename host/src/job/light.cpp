// SPDX-License-Identifier: Apache-2.0
#include "symrig/job/light.hpp"

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/text.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/resample.hpp"
#include "symrig/report/letters.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr std::array<BuiltInLight, 4> kBuiltIn{{
    {"white", "every pixel on", [](Grid grid) { return Image<float>(grid, 1, 1.0F); }},
    {"bar", "a vertical bar, an eighth of the width", [](Grid grid) { return bar_pattern(grid); }},
    {"letters", "the word SYMRIG", [](Grid grid) { return letters_pattern(grid); }},
    {"natural", "a smooth textured picture", [](Grid grid) { return natural_pattern(grid, 1); }},
}};

/// The light is neither a file nor a built-in light.
Error no_light(const std::string& light) {
  std::vector<std::string_view> names;
  names.reserve(kBuiltIn.size());
  for (const BuiltInLight& one : kBuiltIn) names.push_back(one.name);
  return {ErrorCode::not_found,
          fmt::format("there is no file {}, and no built-in light has that name", light),
          fmt::format("{}built-in lights: {}", suggestion(light, names), listed(names))};
}

/// Channels that differ.
bool has_colour(const Image<float>& picture) {
  for (int channel = 1; channel < picture.channels(); ++channel)
    if (!std::ranges::equal(picture.plane(channel), picture.plane(0))) return true;
  return false;
}

}  // namespace

Result<Image<float>> read_light(const std::string& light, Grid grid, const std::string& of,
                                std::string* warning) {
  for (const BuiltInLight& one : kBuiltIn)
    if (one.name == light) return one.draw(grid);
  std::error_code ignored;
  if (!std::filesystem::exists(light, ignored) && !ignored) return no_light(light);
  SYMRIG_TRY(const Image<float> picture, read_image(light));
  if (picture.grid() != grid)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} is {}, {} is {} (rows x columns)", light, to_string(picture.grid()), of,
                             to_string(grid)),
                 fmt::format("scale the picture to {} rows and {} columns", grid.rows, grid.cols)};
  if (warning != nullptr && has_colour(picture))
    *warning = fmt::format("{} is in colour; its luminance is the light, because patterns are white", light);
  return to_gray(picture);
}

std::span<const BuiltInLight> built_in_lights() {
  return kBuiltIn;
}

}  // namespace symrig
