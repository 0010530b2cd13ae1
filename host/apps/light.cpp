// SPDX-License-Identifier: Apache-2.0
#include "light.hpp"

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/resample.hpp"
#include "symrig/report/letters.hpp"

#include <optional>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

std::optional<Image<float>> built_in(const std::string& light, Grid grid) {
  if (light == "white") return Image<float>(grid, 1, 1.0F);
  if (light == "bar") return bar_pattern(grid);
  if (light == "letters") return letters_pattern(grid);
  if (light == "natural") return natural_pattern(grid, 1);
  return std::nullopt;
}

}  // namespace

Result<Image<float>> read_light(const std::string& light, Grid grid, const std::string& of) {
  if (auto drawn = built_in(light, grid)) return *std::move(drawn);
  SYMRIG_TRY(const Image<float> picture, read_image(light));
  if (picture.grid() != grid)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} is {}, {} is {} (rows x columns)", light, to_string(picture.grid()), of,
                             to_string(grid)),
                 fmt::format("scale the picture to {} rows and {} columns", grid.rows, grid.cols)};
  return to_gray(picture);
}

std::string light_help() {
  return "IMAGE is an EXR, PNG or PFM file of that grid; its values are linear light (PNG: code / largest "
         "code), and any\n"
         "finite value is allowed. Colour becomes its luminance: projectors show white light. Or a built-in "
         "light:\n"
         "  white      every pixel on\n"
         "  bar        a vertical bar, an eighth of the width\n"
         "  letters    the word SYMRIG\n"
         "  natural    a smooth textured picture\n";
}

}  // namespace symrig::apps
