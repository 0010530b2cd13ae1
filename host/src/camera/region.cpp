// SPDX-License-Identifier: Apache-2.0
#include "symrig/camera/region.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

namespace symrig {
namespace {

std::uint32_t largest_sum(int bits, int binning) {
  return static_cast<std::uint32_t>(binning * binning) * ((1U << bits) - 1);
}

std::string text(const Region& region) {
  return fmt::format("{} from row {}, column {}", to_string(region.size), region.row, region.col);
}

/// region: resolved(), with its real size.
Result<BinnedGrid> binned_grid_of(Grid picture, Mosaic mosaic, const Region& region) {
  if (region.binning < 1 || region.binning > 64)
    return Error{ErrorCode::bad_argument, fmt::format("binning {} is out of range", region.binning),
                 "1 to 64"};
  const bool inside = region.row >= 0 && region.col >= 0 && region.size.valid() &&
                      region.size.rows <= picture.rows - region.row &&
                      region.size.cols <= picture.cols - region.col;
  if (!inside)
    return Error{
        ErrorCode::bad_argument,
        fmt::format("the region {} is not inside the picture of {}", text(region), to_string(picture)),
        "give sizes as rows x columns"};
  const int square = mosaic == Mosaic::none ? region.binning : region.binning == 1 ? 1 : 2 * region.binning;
  const Grid whole{region.size.rows / square * square, region.size.cols / square * square};
  if (whole != region.size || !whole.valid())
    return Error{
        ErrorCode::bad_argument,
        fmt::format("the region {} is not a whole number of squares of {} pixels, as binning {} needs{}",
                    text(region), square, region.binning, mosaic == Mosaic::none ? "" : " on a mosaic"),
        whole.valid() ? "the next smaller region is " + to_string(whole)
                      : "take a larger region or a smaller binning"};
  return BinnedGrid{{region.size.rows / region.binning, region.size.cols / region.binning},
                    shifted(mosaic, region.row, region.col)};
}

}  // namespace

Region resolved(Grid picture, Region region) {
  if (region.size == Grid{} && region.row >= 0 && region.col >= 0)
    region.size = {picture.rows - region.row, picture.cols - region.col};
  return region;
}

Result<BinnedGrid> binned_grid(Grid picture, Mosaic mosaic, const Region& region) {
  return binned_grid_of(picture, mosaic, resolved(picture, region));
}

int binning_shift(int bits, int binning) {
  return std::max(0, static_cast<int>(std::bit_width(largest_sum(bits, binning))) - 16);
}

NoiseModel binned(const NoiseModel& noise, int binning) {
  const int shift = binning_shift(noise.bits(), binning);
  const double n = binning * binning;
  const double scale = std::ldexp(1.0, -shift);
  const double offset = noise.gain() * noise.gain() * noise.floor_variance();
  return NoiseModel::from_variance_line({
      .offset = n * offset * scale * scale + (1 - scale * scale) / 12,
      .slope = noise.gain() * scale,
      .bits = static_cast<int>(std::bit_width(largest_sum(noise.bits(), binning))) - shift,
      .pedestal = n * noise.pedestal() * scale,
  });
}

}  // namespace symrig
