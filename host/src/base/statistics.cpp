// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/statistics.hpp"

#include <cmath>
#include <vector>

namespace symrig {

double robust_sigma(std::span<const double> values, double centre) {
  // 1 / Φ⁻¹(3/4): half of a normal distribution lies within σ / 1.4826 of its middle.
  constexpr double kSigmas = 1.4826;
  std::vector<double> distances;
  distances.reserve(values.size());
  for (const double value : values) distances.push_back(std::abs(value - centre));
  return kSigmas * median(distances);
}

double robust_sigma(std::span<const double> values) {
  std::vector<double> copy(values.begin(), values.end());
  return robust_sigma(values, median(copy));
}

}  // namespace symrig
