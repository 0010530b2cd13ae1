// SPDX-License-Identifier: Apache-2.0
#include "hdr/merge_checks.hpp"
#include "symrig/hdr/merge.hpp"

#include <algorithm>
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

namespace symrig {
namespace {

constexpr double kSigmas = 5;
constexpr double kNearFull = 0.9;  // share of the range; a selection by a sample's own noise would be biased

ExposureRatio fit(const Frame& shorter, const Frame& longer, const NoiseModel& noise) {
  ExposureRatio ratio;
  ratio.stated = seconds(longer.exposure) / seconds(shorter.exposure);
  const double g = noise.gain(), full = kNearFull * (noise.saturation_code() - noise.pedestal());
  hdr::fit_ratio(ratio, [&](double r, const auto& use) {
    for (std::size_t i = 0; i < shorter.raw.size(); ++i) {
      if (longer.raw[i] >= noise.saturation_code() || shorter.raw[i] >= noise.saturation_code()) continue;
      const double ds = shorter.raw[i] - noise.pedestal(), dl = longer.raw[i] - noise.pedestal();
      // The light from both frames, then both variances at that light.
      const double light = std::max(0.0, (ds + dl) / (1 + r));
      if (r * light > full) continue;
      const double vs = g * g * noise.variance(light / g), vl = g * g * noise.variance(r * light / g);
      if (light < kSigmas * std::sqrt(vs) && r * light < 2 * kSigmas * std::sqrt(vl)) continue;
      use({ds, dl, vs, vl});
    }
  });
  return ratio;
}

}  // namespace

bool ExposureRatio::wrong() const {
  return std::abs(seen / stated - 1) > std::max(imperfect, kSigmas * sigma);
}

std::string ExposureRatio::to_string() const {
  return fmt::format(
      "frame {} is {:.5g} times frame {} by its pixels (±{:.2g}), {:.5g} times by its exposures: off by "
      "{:.2g} %",
      longer, seen, shorter, sigma * seen, stated, 100 * std::abs(seen / stated - 1));
}

Result<std::vector<ExposureRatio>> exposure_ratios(std::span<const Frame> frames, const NoiseModel& noise) {
  if (!noise.valid()) return hdr::bad_argument("the noise model is not valid: " + noise.to_string());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (frames[k].exposure <= Nanoseconds{0})
      return hdr::bad_argument(fmt::format("exposure of frame {} is not above 0", k));
    if (frames[k].raw.size() != frames.front().raw.size())
      return Error{ErrorCode::size_mismatch, fmt::format("frame {} has {} samples, frame 0 {}", k,
                                                         frames[k].raw.size(), frames.front().raw.size())};
  }
  return hdr::neighbouring_ratios(
      frames, [&](const Frame& shorter, const Frame& longer) { return fit(shorter, longer, noise); });
}

}  // namespace symrig
