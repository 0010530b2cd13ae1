// SPDX-License-Identifier: Apache-2.0
#include "calibration/stated_sigma.hpp"

#include "symrig/base/quantile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace symrig::calibration {
namespace {

/// Scatter over stated deviation of one window, and the clarity at its centre.
struct Scatter {
  float clarity = 0;
  double ratio = 0;
};

std::optional<double> ratio_at(const Image<float>& sigma, const RawMap& map, const Image<float>& position,
                               int row, int col, int apart) {
  constexpr std::array<double, 3> kWeights{1, -2, 1};
  double sum = 0, variance = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int r = row + (i - 1) * apart, c = col + (j - 1) * apart;
      if (!map.mask.at(r, c)) return std::nullopt;
      const double weight = kWeights[i] * kWeights[j];
      sum += weight * static_cast<double>(position.at(r, c));
      variance += std::pow(weight * static_cast<double>(sigma.at(r, c)), 2);
    }
  if (!(variance > 0)) return std::nullopt;
  return sum / std::sqrt(variance);
}

std::vector<Scatter> scatter_of(const Image<float>& sigma, const RawMap& map, StripeAxis axis,
                                const Image<float>& clarity, int apart) {
  constexpr double kMost = 40'000;
  const Grid grid = map.grid();
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(grid.size()) / kMost)));
  std::vector<Scatter> all;
  for (int row = apart; row < grid.rows - apart; row += stride)
    for (int col = apart; col < grid.cols - apart; col += stride)
      if (const auto ratio = ratio_at(sigma, map, map.position[axis_index(axis)], row, col, apart))
        all.push_back({clarity.at(row, col), *ratio});
  return all;
}

/// The factor as a function of the clarity: linear in its logarithm between the groups.
class Factor {
 public:
  /// all: of one distance between the pixels of a window. The largest factor of all distances stays.
  void add(std::vector<Scatter> all) {
    constexpr std::size_t kGroups = 4, kLeast = 200;
    if (all.size() < kLeast) return;
    std::ranges::sort(all, {}, &Scatter::clarity);
    const bool first = points_.empty();
    for (std::size_t group = 0; group < kGroups; ++group) {
      const std::size_t begin = group * all.size() / kGroups, end = (group + 1) * all.size() / kGroups;
      std::vector<double> ratios;
      for (std::size_t k = begin; k < end; ++k) ratios.push_back(all[k].ratio);
      const double factor = robust_sigma(ratios, 0);
      if (first)
        points_.push_back({log_of(all[(begin + end) / 2].clarity), factor});
      else
        points_[group].factor = std::max(points_[group].factor, factor);
    }
  }

  bool known() const {
    // Exact positions, as in a picture without noise, say nothing about a deviation.
    return !points_.empty() && std::ranges::all_of(points_, [](const Point& p) { return p.factor > 0; });
  }
  float operator()(float clarity) const {
    const double at = log_of(clarity);
    for (std::size_t k = 0; k + 1 < points_.size(); ++k) {
      const Point &low = points_[k], &high = points_[k + 1];
      if (at >= high.at && k + 2 < points_.size()) continue;
      const double share = high.at > low.at ? std::clamp((at - low.at) / (high.at - low.at), 0.0, 1.0) : 0;
      return static_cast<float>(low.factor + share * (high.factor - low.factor));
    }
    return 1;
  }

 private:
  struct Point {
    double at, factor;
  };
  static double log_of(float clarity) { return std::log(std::max(static_cast<double>(clarity), 1e-6)); }

  std::vector<Point> points_;
};

}  // namespace

void scale_to_scatter(Image<float>& sigma, const RawMap& map, StripeAxis axis, const Image<float>& clarity) {
  Factor factor;
  for (const int apart : {1, 2, 3, 5}) factor.add(scatter_of(sigma, map, axis, clarity, apart));
  if (!factor.known()) return;
  for (std::size_t i = 0; i < sigma.values().size(); ++i)
    if (map.mask.values()[i]) sigma.values()[i] *= factor(clarity.values()[i]);
}

}  // namespace symrig::calibration
