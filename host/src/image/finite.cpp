// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/finite.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

namespace symrig {

Result<void> check_finite(const Image<float>& image, const std::string& name) {
  return check_finite(image.values(), image.grid(), name);
}

Result<void> check_finite(std::span<const float> values, Grid grid, const std::string& name) {
  // Counting takes a vector of pixels at a time; searching does not.
  constexpr std::uint32_t kExponent = 0x7F800000;
  const auto is_bad = [](float v) { return (std::bit_cast<std::uint32_t>(v) & kExponent) == kExponent; };
  if (std::ranges::count_if(values, is_bad) == 0) return {};
  const auto bad = std::ranges::find_if(values, is_bad);
  const std::int64_t index = bad - values.begin();
  const std::int64_t pixel = index % grid.size();
  return Error{ErrorCode::bad_value,
               fmt::format("{}: pixel (row {}, column {}) of channel {} is {}", name, pixel / grid.cols,
                           pixel % grid.cols, index / grid.size(), std::isnan(*bad) ? "NaN" : "infinite"),
               "replace such pixels before you use the picture as light"};
}

}  // namespace symrig
