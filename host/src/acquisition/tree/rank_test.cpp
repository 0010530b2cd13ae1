// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/rank_test.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace symrig::acquisition {
namespace {

/// The largest share of the energy that came while one child was lit.
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

Comparison RankEvidence::pair(int a, int b) const {
  const std::size_t i = a;
  const std::size_t j = b;
  Comparison both = on_row[i][j];
  return both += on_col[i][j];
}

Comparison RankEvidence::total() const {
  Comparison sum;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) sum += pair(a, b);
  return sum;
}

bool fits_rank1(const Comparison& e, const RankRule& rule) {
  return e.misfit <= squared(rule.signal_fraction) * e.signal + e.samples * squared(rule.flood_fraction) +
                         noise_allowance(e.noise, e.samples, rule.noise_sigmas);
}

bool concentrated(const RankEvidence& e, const RankRule& rule) {
  std::array<double, 4> of_col{}, of_row{};
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = 0; b < 4; ++b) {
      of_col[b] += e.on_row[a][b].energy();
      of_row[a] += e.diagonal ? e.on_row[b][a].energy() : e.on_col[a][b].energy();
    }
  }
  return largest_share(of_row) > rule.concentration && largest_share(of_col) > rule.concentration;
}

bool is_empty(const Energy& e, const RankRule& rule) {
  return e.signal <=
         e.samples * squared(rule.empty_fraction) + noise_allowance(e.noise, e.samples, rule.noise_sigmas);
}

bool is_leaf(const RankEvidence& evidence, const RankRule& rule) {
  return fits_rank1(evidence.total(), rule) && !concentrated(evidence, rule);
}

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
