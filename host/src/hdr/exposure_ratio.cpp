// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/exposure_ratio.hpp"

#include "hdr/merge_checks.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr double kSigmas = 5;
constexpr std::int64_t kFewest = 64;
constexpr int kRounds = 8;
constexpr double kNearFull = 0.9;  // share of the range; a selection by a sample's own noise would be biased

/// Fits d_long = r d_short. With both noisy, the best light of a pixel given r is
/// (d_s / v_s + r d_l / v_l) / (1 / v_s + r² / v_l); r minimises the rest: Newton on Σ (d_l − r d_s)² / (v_l
/// + r² v_s).
ExposureRatio fit(const Frame& shorter, const Frame& longer, const NoiseModel& noise) {
  ExposureRatio ratio;
  ratio.stated = seconds(longer.exposure) / seconds(shorter.exposure);
  ratio.seen = ratio.stated;
  const double g = noise.gain(), full = kNearFull * (noise.saturation_code() - noise.pedestal());
  double information = 0;
  for (int round = 0; round < kRounds; ++round) {
    const double r = ratio.seen;
    double up = 0, down = 0;
    information = 0;
    ratio.pixels = 0;
    for (std::size_t i = 0; i < shorter.raw.size(); ++i) {
      if (longer.raw[i] >= noise.saturation_code() || shorter.raw[i] >= noise.saturation_code()) continue;
      const double ds = shorter.raw[i] - noise.pedestal(), dl = longer.raw[i] - noise.pedestal();
      // The light from both frames, then both variances at that light.
      const double light = std::max(0.0, (ds + dl) / (1 + r));
      if (r * light > full) continue;
      const double vs = g * g * noise.variance(light / g), vl = g * g * noise.variance(r * light / g);
      if (light < kSigmas * std::sqrt(vs) && r * light < 2 * kSigmas * std::sqrt(vl)) continue;
      const double v = vl + r * r * vs;
      const double best = (ds / vs + r * dl / vl) / (1 / vs + r * r / vl);  // uncorrelated with dl − r ds
      up += best * (dl - r * ds) / v;
      down += best * best / v;
      information += (best * best - 1 / (1 / vs + r * r / vl)) / v;
      ++ratio.pixels;
    }
    if (ratio.pixels < kFewest || !(down > 0) || !(information > 0)) return ratio;
    const double step = up / down;
    ratio.seen += step;
    if (std::abs(step) < 1e-9 * ratio.seen) break;
  }
  ratio.sigma = 1 / std::sqrt(information) / ratio.seen;
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
  std::vector<std::size_t> order(frames.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return frames[a].exposure < frames[b].exposure; });
  std::vector<ExposureRatio> ratios;
  for (std::size_t k = 0; k + 1 < order.size(); ++k) {
    ExposureRatio ratio = fit(frames[order[k]], frames[order[k + 1]], noise);
    ratio.shorter = order[k];
    ratio.longer = order[k + 1];
    if (ratio.sigma > 0) ratios.push_back(ratio);
  }
  return ratios;
}

}  // namespace symrig
