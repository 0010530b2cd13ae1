// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/prediction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace symrig::acquisition {

namespace {

double mean_energy(const Comparison& seen) {
  return seen.samples > 0 ? seen.energy() / seen.samples : 0;
}

double share(const PairTable& table, const Comparison& pair) {
  double total = 0;
  for (const auto& row : table)
    for (const Comparison& at : row) total += at.energy();
  return total > 0 ? pair.energy() / total : 0;
}

}  // namespace

double undecayed_misfit(const RankEvidence& parent, int a, int b, int level, const RankRule& rule,
                        const Economy& economy) {
  constexpr double kUnpredictable = std::numeric_limits<double>::infinity();
  const std::size_t i = a;
  const std::size_t j = b;
  const Comparison& row = parent.on_row[i][j];
  const Comparison& col = parent.diagonal ? parent.on_row[j][i] : parent.on_col[i][j];
  const double signal = std::sqrt(mean_energy(row) * mean_energy(col));
  if (parent.diagonal)
    return a == b ? kUnpredictable : economy.diagonal_spread * economy.diagonal_spread * signal;
  if (share(parent.on_row, row) > economy.dominance && share(parent.on_col, col) > economy.dominance)
    return kUnpredictable;
  const Comparison both = parent.pair(a, b);
  if (both.samples <= 0) return kUnpredictable;
  const double allowed = noise_allowance(both.noise, both.samples, rule.noise_sigmas);
  const double misfit = std::max(0.0, both.misfit - allowed) / both.samples;
  const double risk = std::min(std::ldexp(economy.risk, level), economy.largest_risk);
  if (std::sqrt(misfit) > risk * rule.flood_fraction) return kUnpredictable;
  return std::sqrt(misfit * signal);
}

}  // namespace symrig::acquisition
