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

/// Scatter over stated deviation of one window, and the clarity where it begins.
struct Scatter {
  float clarity = 0;
  double ratio = 0;
};

/// Four pixels of a line, `apart` pixels from one to the next.
struct Window {
  int apart = 1;
  bool down = false;  ///< along a column of the picture, not a row
};

/// The third difference of positions, over its deviation if errors are independent. A surface that bends like
/// a parabola has none.
std::optional<double> ratio_at(const Image<float>& sigma, const RawMap& map, const Image<float>& position,
                               int row, int col, Window window) {
  constexpr std::array<double, 4> kWeights{1, -3, 3, -1};
  double sum = 0, variance = 0;
  for (int k = 0; k < std::ssize(kWeights); ++k) {
    const int r = row + (window.down ? k * window.apart : 0), c = col + (window.down ? 0 : k * window.apart);
    if (!map.mask.at(r, c)) return std::nullopt;
    sum += kWeights[k] * static_cast<double>(position.at(r, c));
    variance += std::pow(kWeights[k] * static_cast<double>(sigma.at(r, c)), 2);
  }
  if (!(variance > 0)) return std::nullopt;
  return sum / std::sqrt(variance);
}

std::vector<Scatter> scatter_of(const Image<float>& sigma, const RawMap& map, StripeAxis axis,
                                const Image<float>& clarity, Window window) {
  constexpr double kMost = 40'000;
  const Grid grid = map.grid();
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(grid.size()) / kMost)));
  const int length = 3 * window.apart, rows = grid.rows - (window.down ? length : 0),
            cols = grid.cols - (window.down ? 0 : length);
  std::vector<Scatter> all;
  for (int row = 0; row < rows; row += stride)
    for (int col = 0; col < cols; col += stride)
      if (const auto ratio = ratio_at(sigma, map, map.position[axis_index(axis)], row, col, window))
        all.push_back({clarity.at(row, col), *ratio});
  return all;
}

/// The factor as a function of the clarity: linear in its logarithm between the groups.
class Factor {
 public:
  static constexpr std::size_t kGroups = 4;

  /// all: of one kind of window. Of several kinds, the mean of the squares counts.
  void add(std::vector<Scatter> all) {
    constexpr std::size_t kLeast = 200;
    if (all.size() < kLeast) return;
    std::ranges::sort(all, {}, &Scatter::clarity);
    points_.resize(kGroups);
    ++kinds_;
    for (std::size_t group = 0; group < kGroups; ++group) {
      const std::size_t begin = group * all.size() / kGroups, end = (group + 1) * all.size() / kGroups;
      std::vector<double> ratios;
      for (std::size_t k = begin; k < end; ++k) ratios.push_back(all[k].ratio);
      Point& point = points_[group];
      point.at = log_of(all[(begin + end) / 2].clarity);
      point.square += (std::pow(robust_sigma(ratios, 0), 2) - point.square) / kinds_;
    }
  }
  /// The larger of two factors stays.
  void raise_to(const Factor& other) {
    if (points_.empty()) *this = other;
    for (std::size_t group = 0; group < other.points_.size(); ++group)
      points_[group].square = std::max(points_[group].square, other.points_[group].square);
  }

  bool known() const {
    // Exact positions, as in a picture without noise, say nothing about a deviation.
    return !points_.empty() && std::ranges::all_of(points_, [](const Point& p) { return p.square > 0; });
  }
  float operator()(float clarity) const {
    const double at = log_of(clarity);
    for (std::size_t k = 0; k + 1 < points_.size(); ++k) {
      const Point &low = points_[k], &high = points_[k + 1];
      if (at >= high.at && k + 2 < points_.size()) continue;
      const double share = high.at > low.at ? std::clamp((at - low.at) / (high.at - low.at), 0.0, 1.0) : 0;
      return static_cast<float>(std::lerp(std::sqrt(low.square), std::sqrt(high.square), share));
    }
    return 1;
  }

 private:
  struct Point {
    double at = 0, square = 0;
  };
  static double log_of(float clarity) { return std::log(std::max(static_cast<double>(clarity), 1e-6)); }

  std::vector<Point> points_;
  int kinds_ = 0;
};

}  // namespace

void scale_to_scatter(Image<float>& sigma, const RawMap& map, StripeAxis axis, const Image<float>& clarity) {
  Factor factor;
  for (const bool down : {false, true}) {
    Factor along;
    for (const int apart : {1, 2}) along.add(scatter_of(sigma, map, axis, clarity, {apart, down}));
    factor.raise_to(along);
  }
  if (!factor.known()) return;
  for (std::size_t i = 0; i < sigma.values().size(); ++i)
    if (map.mask.values()[i]) sigma.values()[i] *= factor(clarity.values()[i]);
}

}  // namespace symrig::calibration
