// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/merge.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string>
#include <vector>

namespace symrig::hdr {

Error bad_argument(std::string what, std::string hint = {});

/// fails: bad_argument.
Result<void> check_sensor(Grid grid, int channels, const NoiseModel& noise);
/// fails: size_mismatch, bad_argument (scale).
Result<void> check_options(const MergeOptions& options, Grid grid, int channels);

/// What two exposures see of one pixel, and the variance of each at their common light.
struct RatioSample {
  double shorter, longer;
  double shorter_variance, longer_variance;
};

/// Fits longer = r shorter to pixels, with noise in both, from ratio.stated. The best light of a pixel given
/// r is (s / v_s + r l / v_l) / (1 / v_s + r² / v_l); r minimises the rest: Newton on Σ (l − r s)² / (v_l +
/// r² v_s). each(r, use) hands the pixels to use(RatioSample); r decides which ones, and their variances. Too
/// few pixels: sigma stays 0.
template <class Each>
void fit_ratio(ExposureRatio& ratio, const Each& each) {
  constexpr int kRounds = 8;
  constexpr std::int64_t kFewest = 64;
  ratio.seen = ratio.stated;
  double information = 0;
  for (int round = 0; round < kRounds; ++round) {
    const double r = ratio.seen;
    double up = 0, down = 0;
    information = 0;
    ratio.pixels = 0;
    each(r, [&](const RatioSample& one) {
      const double v = one.longer_variance + r * r * one.shorter_variance;
      const double known = 1 / one.shorter_variance + r * r / one.longer_variance;
      // Uncorrelated with longer − r shorter.
      const double best = (one.shorter / one.shorter_variance + r * one.longer / one.longer_variance) / known;
      up += best * (one.longer - r * one.shorter) / v;
      down += best * best / v;
      information += (best * best - 1 / known) / v;
      ++ratio.pixels;
    });
    if (ratio.pixels < kFewest || !(down > 0) || !(information > 0)) return;
    const double step = std::clamp(up / down, -r / 2, r);
    ratio.seen += step;
    if (std::abs(step) < 1e-9 * ratio.seen) break;
  }
  ratio.sigma = 1 / std::sqrt(information) / ratio.seen;
}

/// Ratios of neighbouring exposures: fit(shorter, longer) of two frames gives each. Those without a sigma are
/// left out.
template <class Fit>
std::vector<ExposureRatio> neighbouring_ratios(std::span<const Frame> frames, const Fit& fit) {
  std::vector<std::size_t> order(frames.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return frames[a].exposure < frames[b].exposure; });
  std::vector<ExposureRatio> ratios;
  for (std::size_t k = 0; k + 1 < order.size(); ++k) {
    ExposureRatio ratio = fit(frames[order[k]], frames[order[k + 1]]);
    ratio.shorter = order[k];
    ratio.longer = order[k + 1];
    if (ratio.sigma > 0) ratios.push_back(ratio);
  }
  return ratios;
}

}  // namespace symrig::hdr
