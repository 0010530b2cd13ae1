// SPDX-License-Identifier: Apache-2.0
#include "acquisition/rank_test.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace symrig::acquisition {
namespace {

double largest_share(const std::array<double, 4>& energy) {
  const double total = std::accumulate(energy.begin(), energy.end(), 0.0);
  return total > 0 ? *std::max_element(energy.begin(), energy.end()) / total : 0;
}

double squared(double x) {
  return x * x;
}

}  // namespace

double noise_allowance(double noise, double samples, double sigmas) {
  if (sigmas <= 0 || samples <= 0) return 0;
  return noise * (1 + sigmas * std::sqrt(2 / samples));
}

bool fits_rank1(const RankEvidence& e, const RankRule& rule) {
  return e.misfit <= squared(rule.signal_fraction) * e.signal + e.samples * squared(rule.flood_fraction) +
                         noise_allowance(e.noise, e.samples, rule.noise_sigmas);
}

bool concentrated(const RankEvidence& e, const RankRule& rule) {
  return largest_share(e.row_child) > rule.concentration && largest_share(e.col_child) > rule.concentration;
}

bool is_empty(const Energy& e, const RankRule& rule) {
  return e.signal <=
         e.samples * squared(rule.empty_fraction) + noise_allowance(e.noise, e.samples, rule.noise_sigmas);
}

bool is_leaf(const RankEvidence& evidence, const RankRule& rule) {
  return fits_rank1(evidence, rule) && !concentrated(evidence, rule);
}

}  // namespace symrig::acquisition
