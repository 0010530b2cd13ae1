// SPDX-License-Identifier: Apache-2.0
#include "symrig/projector/placement.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr std::size_t kCodes = 256;

}  // namespace

Result<CodeTable> CodeTable::from_light(std::span<const double> light) {
  if (light.size() != kCodes)
    return Error{ErrorCode::bad_argument, fmt::format("a response has {} values", light.size()),
                 "give the light at each of the 256 codes"};
  for (std::size_t code = 0; code < kCodes; ++code)
    if (!std::isfinite(light[code]) || (code > 0 && light[code] < light[code - 1]))
      return Error{ErrorCode::bad_value, fmt::format("a response has {} at code {}", light[code], code),
                   "give finite values that never decrease"};
  const double range = light.back() - light.front();
  if (!(range > 0) || !std::isfinite(range))
    return Error{ErrorCode::bad_value, "a response is equal at codes 0 and 255", "measure it again"};
  CodeTable table;
  table.light_.reserve(kCodes);
  for (const double value : light) table.light_.push_back((value - light.front()) / range);
  return table;
}

std::uint8_t CodeTable::code(float v) const {
  if (v <= 0) return 0;
  if (v >= 1) return 255;
  if (light_.empty()) return static_cast<std::uint8_t>(std::lround(std::floor(255. * v + 0.5)));
  // `above` is the first code that is at least as bright. The last darker code may be nearer. Of several
  // equally bright codes, the lowest one is used.
  const auto above = std::lower_bound(light_.begin(), light_.end(), double{v});
  if (above == light_.begin()) return 0;
  const double below = *(above - 1);
  const auto nearest = *above - v < v - below ? above : std::lower_bound(light_.begin(), above, below);
  return static_cast<std::uint8_t>(nearest - light_.begin());
}

Result<Image<std::uint8_t>> to_codes(const Pattern& pattern, Grid grid, const CodeTable& table,
                                     std::size_t number) {
  if (pattern.grid() != grid || pattern.channels() != 1)
    return Error{ErrorCode::size_mismatch,
                 fmt::format("pattern {} is {} with {} channels, but the projector shows {} with 1", number,
                             to_string(pattern.grid()), pattern.channels(), to_string(grid)),
                 "give patterns on the projector's grid"};
  Image<std::uint8_t> codes(grid);
  const auto values = pattern.values();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] >= 0 && values[i] <= 1))
      return Error{ErrorCode::bad_value,
                   fmt::format("pattern {} is {} at row {}, column {}", number, values[i],
                               static_cast<int>(i) / grid.cols, static_cast<int>(i) % grid.cols),
                   "give values from 0 to 1"};
    codes.values()[i] = table.code(values[i]);
  }
  return codes;
}

}  // namespace symrig
