// SPDX-License-Identifier: Apache-2.0
#include "calibration/flare_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::calibration {
namespace {

constexpr double kStep = 1.1;  // ratio of one trial length to the one before

/// The best share at one length, and how much it lowers χ².
struct ShareFit {
  double share = 0, sigma = 0, length = 1, gain = 0;
};

/// min over s of Σ (r − s f)² / σ²: s = Σ r f / σ² / Σ f² / σ²; χ² falls by (Σ r f / σ²)² / Σ f² / σ².
ShareFit fit_share(std::span<const Imbalance> found, const Comb& comb, double length) {
  double rf = 0, ff = 0;
  for (const Imbalance& one : found) {
    const double f = flare_imbalance(comb, one.distance, length), weight = 1 / (one.sigma * one.sigma);
    rf += weight * one.value * f;
    ff += weight * f * f;
  }
  if (!(ff > 0)) return {};
  return {rf / ff, 1 / std::sqrt(ff), length, rf * rf / ff};
}

/// The shortest length that the far stripes can see: a shorter flare falls below 5 % before it reaches them.
double shortest_length(const Comb& comb) {
  return std::max(1, comb.offsets.back()) / 3.0;
}

}  // namespace

double flare_imbalance(const Comb& comb, int distance, double length) {
  const double k = std::exp(-1 / length);
  double sum = std::pow(k, distance);
  for (int apart = 1; apart < comb.groups; ++apart) {
    const double pairs = (comb.groups - apart) / static_cast<double>(comb.groups);
    sum +=
        pairs * (std::pow(k, apart * comb.period + distance) - std::pow(k, apart * comb.period - distance));
  }
  return (1 - k) * sum;
}

Flare fit_flare(std::span<const Imbalance> found, const Comb& comb) {
  std::vector<ShareFit> fits;
  const double shortest = shortest_length(comb);
  const int steps = static_cast<int>(std::log(comb.length() / shortest) / std::log(kStep));
  for (int step = 0; step <= steps; ++step)
    fits.push_back(fit_share(found, comb, shortest * std::pow(kStep, step)));
  const ShareFit best = *std::ranges::max_element(fits, {}, &ShareFit::gain);
  double low = best.share, high = best.share;
  for (const ShareFit& fit : fits) {
    if (fit.gain < best.gain - 1) continue;
    low = std::min(low, fit.share);
    high = std::max(high, fit.share);
  }
  return {best.share, std::hypot(best.sigma, (high - low) / 2), best.length, std::sqrt(best.gain)};
}

}  // namespace symrig::calibration
