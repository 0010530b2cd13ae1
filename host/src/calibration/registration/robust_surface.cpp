// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/robust_surface.hpp"

#include "symrig/base/quantile.hpp"
#include "symrig/base/tukey.hpp"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// |value − surface| in units of what the weights say.
std::vector<double> distances(const SplineSurface& surface, std::span<const SeenValue> values) {
  std::vector<double> off(values.size());
  tbb::parallel_for(std::size_t{0}, values.size(), [&](std::size_t i) {
    off[i] = std::abs(values[i].value - surface(values[i].at)) * std::sqrt(values[i].weight);
  });
  return off;
}

}  // namespace

std::optional<RobustFit> fit_robustly(SplineSurface& surface, std::span<const SeenValue> values,
                                      double smoothing, int rounds, double least_sigma) {
  std::vector<SeenValue> weighted(values.begin(), values.end());
  RobustFit fit;
  for (int round = 0;; ++round) {
    if (!surface.fit(weighted, smoothing)) return std::nullopt;
    if (round == rounds) return fit;
    const std::vector<double> off = distances(surface, values);
    std::vector<double> sorted = off;
    fit = {std::max(1.4826 * median(sorted), least_sigma), 0};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double keep = tukey_weight(off[i] / fit.sigma);
      weighted[i].weight = values[i].weight * keep;
      fit.left_out += keep == 0 ? 1 : 0;
    }
    fit.left_out /= static_cast<double>(values.size());
  }
}

}  // namespace symrig::calibration
