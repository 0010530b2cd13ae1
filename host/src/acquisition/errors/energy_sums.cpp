// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/energy_sums.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::acquisition {

void EnergySums::add(std::size_t pixel, double e, double y, double of_model, double variance) {
  error += e * e - variance;
  signal += y * y - variance;
  model += of_model * of_model;
  noise += variance;
  error_noise_ += 4 * variance * e * e - 2 * variance * variance;
  signal_noise_ += 4 * variance * y * y - 2 * variance * variance;
  resolution_ += 2 * variance * variance;
  error_at_[pixel] += e * e - variance;
  signal_at_[pixel] += y * y - variance;
  ++samples_;
}

double EnergySums::scatter(const BlockTree& tree, double ratio) const {
  constexpr std::size_t kFewestBlocks = 16;
  std::vector<double> before(error_at_.size() + 1);
  for (std::size_t t = 0; t < error_at_.size(); ++t)
    before[t + 1] = before[t] + error_at_[t] - ratio * signal_at_[t];
  double largest = 0;
  for (int level = 0; level < tree.levels(); ++level) {
    const auto blocks = static_cast<double>(tree.level(level).size());
    if (tree.level(level).size() < kFewestBlocks && level + 1 < tree.levels()) continue;
    double squares = 0;
    for (const Block& block : tree.level(level)) {
      const double sum = before[block.end] - before[block.begin];
      squares += sum * sum;
    }
    const double mean = before.back() / blocks;
    if (blocks > 1) largest = std::max(largest, (squares - blocks * mean * mean) * blocks / (blocks - 1));
  }
  return largest + doubt_;
}

EnergyInterval energy_interval(double energy, double variance) {
  constexpr double kSigmas = 2, kMostSigmas = 10, kInNoise = 4;
  const double sigma = std::sqrt(std::max(0.0, variance));
  if (energy <= sigma) return {0, std::max(0.0, energy) + kInNoise * sigma};
  const double most = energy + kMostSigmas * sigma;
  // χ²_d / d at ± 2σ is (1 − 2/(9d) ± 2 √(2/(9d)))³; 2/d = variance / energy².
  const double ninth = variance / (9 * energy * energy);
  const auto quantile = [&](double sigmas) {
    return std::pow(std::max(0.0, 1 - ninth + sigmas * std::sqrt(ninth)), 3);
  };
  const double least = quantile(-kSigmas);
  return {energy / quantile(kSigmas), least > 0 ? std::min(most, energy / least) : most};
}

double half_width(const EnergyInterval& interval, double signal, double value) {
  const auto relative = [&](double energy) { return std::sqrt(std::max(0.0, energy) / signal); };
  return std::max(relative(interval.high) - value, value - relative(interval.low));
}

}  // namespace symrig::acquisition
