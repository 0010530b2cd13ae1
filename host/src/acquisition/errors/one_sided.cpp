// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/one_sided.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace symrig::acquisition {
namespace {

constexpr double kSure = 5;  // standard deviations, of some dozen sums

/// Sums over rectangles, what lies outside the picture counted as 0.
class Integral {
 public:
  explicit Integral(const Image<float>& picture)
      : rows_(picture.grid().rows),
        cols_(picture.grid().cols),
        sum_(static_cast<std::size_t>(rows_ + 1) * static_cast<std::size_t>(cols_ + 1)) {
    for (int r = 0; r < rows_; ++r)
      for (int c = 0; c < cols_; ++c)
        sum_[at(r + 1, c + 1)] =
            static_cast<double>(picture.at(r, c)) + sum_[at(r, c + 1)] + sum_[at(r + 1, c)] - sum_[at(r, c)];
  }
  /// Rows [top, bottom], columns [left, right].
  double of(int top, int bottom, int left, int right) const {
    const int r0 = std::clamp(top, 0, rows_), r1 = std::clamp(bottom + 1, 0, rows_);
    const int c0 = std::clamp(left, 0, cols_), c1 = std::clamp(right + 1, 0, cols_);
    return sum_[at(r1, c1)] - sum_[at(r0, c1)] - sum_[at(r1, c0)] + sum_[at(r0, c0)];
  }

 private:
  std::size_t at(int r, int c) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(cols_ + 1) + static_cast<std::size_t>(c);
  }
  int rows_, cols_;
  std::vector<double> sum_;
};

/// A box on one side of a pixel: rows and columns from it.
struct Side {
  int top, bottom, left, right;
  double cells() const { return 2.0 * (bottom - top + 1) * (right - left + 1); }
};
std::array<Side, 4> boxes(int radius) {
  return {{{-radius, radius, 1, radius},
           {1, radius, -radius, radius},
           {1, radius, 1, radius},
           {1, radius, -radius, -1}}};
}
/// Half of the pixels around one, up to two away.
std::vector<Side> neighbours() {
  constexpr int kFar = 2;
  std::vector<Side> all;
  for (int dy = 0; dy <= kFar; ++dy)
    for (int dx = dy == 0 ? 1 : -kFar; dx <= kFar; ++dx) all.push_back({dy, dy, dx, dx});
  return all;
}

/// What one K finds.
class Search {
 public:
  Search(const Image<float>& residual, const Image<float>& z) : z_(z), sums_(residual) {
    for (const float v : z.values()) lit_ += v != 0 ? 1 : 0;
  }
  OneSided with(const Side& s) const {
    const Grid grid = z_.grid();
    double product = 0, squares = 0;
    for (int r = 0; r < grid.rows; ++r)
      for (int c = 0; c < grid.cols; ++c) {
        const auto sign = static_cast<double>(z_.at(r, c));
        if (sign == 0) continue;
        const double w = sums_.of(r + s.top, r + s.bottom, c + s.left, c + s.right) -
                         sums_.of(r - s.bottom, r - s.top, c - s.right, c - s.left);
        product += w * sign;
        squares += w * w;
      }
    if (squares <= 0) return {};
    const double energy =
        (product * product - squares) * static_cast<double>(grid.size()) / (lit_ * lit_ * s.cells());
    return {std::max(0.0, energy), std::abs(product) / std::sqrt(squares)};
  }

 private:
  const Image<float>& z_;
  Integral sums_;
  double lit_ = 0;
};

}  // namespace

OneSided one_sided(const Image<float>& residual, const Image<float>& z) {
  const Search search(residual, z);
  OneSided near;  // neighbours have nothing in common: what they find adds up
  for (const Side& s : neighbours()) {
    const OneSided one = search.with(s);
    near.sigmas = std::max(near.sigmas, one.sigmas);
    if (one.sigmas > kSure) near.energy += one.energy;
  }
  OneSided far;
  const Grid grid = residual.grid();
  for (int radius = 2; 2 * radius < std::max(grid.rows, grid.cols); radius *= 2)
    for (const Side& s : boxes(radius)) {
      const OneSided one = search.with(s);
      if (one.sigmas > kSure && one.energy > far.energy) far = one;
    }
  return near.energy >= far.energy ? near : far;
}

}  // namespace symrig::acquisition
