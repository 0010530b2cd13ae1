// SPDX-License-Identifier: Apache-2.0
#include "hdr/merge_checks.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig::hdr {
namespace {

Result<void> check_black(const Radiance& black, Grid grid, int channels) {
  const auto fits = [&](const auto& image) { return image.grid() == grid && image.channels() == channels; };
  if (!fits(black.mean) || !fits(black.variance) || !fits(black.valid))
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the black photograph is {} with {} channels; the bracket is {} with {}",
                             to_string(black.mean.grid()), black.mean.channels(), to_string(grid), channels)};
  return {};
}

Result<void> check_dead(const Image<std::uint8_t>& dead, Grid grid, int channels) {
  if (dead.grid() == grid && (dead.channels() == 1 || dead.channels() == channels)) return {};
  return Error{ErrorCode::size_mismatch, fmt::format("the dead-pixel mask is {}; the bracket is {}",
                                                     to_string(dead.grid()), to_string(grid))};
}

}  // namespace

Error bad_argument(std::string what, std::string hint) {
  return {ErrorCode::bad_argument, std::move(what), std::move(hint)};
}

Result<void> check_sensor(Grid grid, int channels, const NoiseModel& noise) {
  if (!grid.valid() || channels < 1)
    return bad_argument(
        fmt::format("cannot merge a bracket of {} pixels and {} channels", to_string(grid), channels));
  if (!noise.valid()) return bad_argument("the noise model is not valid: " + noise.to_string());
  return {};
}

Result<void> check_options(const MergeOptions& options, Grid grid, int channels) {
  if (!std::isfinite(options.scale) || options.scale <= 0)
    return bad_argument(fmt::format("the scale is {}; it must be a positive number", options.scale));
  if (options.black) SYMRIG_CHECK(check_black(*options.black, grid, channels));
  if (options.dead) SYMRIG_CHECK(check_dead(*options.dead, grid, channels));
  return {};
}

}  // namespace symrig::hdr
