// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

namespace symrig::board {

/// A point of the plane of drift x and clock y.
struct DriftAndClock {
  double x, y;
};

/// A convex polygon in a fixed array, cut by half-planes one after another (Sutherland and Hodgman, CACM
/// 1974). Cuts: the largest number of cuts; each adds at most one corner.
template <std::size_t Cuts>
class ConvexPolygon {
 public:
  ConvexPolygon(double x_low, double x_high, double y_low, double y_high)
      : corners_{{{x_low, y_low}, {x_high, y_low}, {x_high, y_high}, {x_low, y_high}}} {
    if (x_low > x_high || y_low > y_high) count_ = 0;
  }

  /// Keeps the part where a x + b y <= c.
  void cut(double a, double b, double c) {
    const auto excess = [=](const DriftAndClock& p) { return a * p.x + b * p.y - c; };
    std::array<DriftAndClock, Cuts + 4> kept;
    std::size_t count = 0;
    for (std::size_t k = 0; k < count_; ++k) {
      const DriftAndClock& from = corners_[k];
      const DriftAndClock& to = corners_[(k + 1) % count_];
      const double begin = excess(from);
      const double end = excess(to);
      if (begin <= 0) kept[count++] = from;
      if ((begin < 0 && end > 0) || (begin > 0 && end < 0)) {
        const double share = begin / (begin - end);
        kept[count++] = {from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)};
      }
    }
    corners_ = kept;
    count_ = count;
  }

  bool empty() const { return count_ == 0; }
  /// The lowest and the highest value of one coordinate. The polygon must not be empty.
  template <class Coordinate>
  std::pair<double, double> extent(Coordinate coordinate) const {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (std::size_t k = 0; k < count_; ++k) {
      low = std::min(low, coordinate(corners_[k]));
      high = std::max(high, coordinate(corners_[k]));
    }
    return {low, high};
  }

 private:
  std::array<DriftAndClock, Cuts + 4> corners_;
  std::size_t count_ = 4;
};

}  // namespace symrig::board
