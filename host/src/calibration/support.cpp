// SPDX-License-Identifier: Apache-2.0
#include "calibration/raw_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

constexpr int kReach = 3;  // 7 × 7 pixels are asked
constexpr int kApart = 3;  // camera pixels between the two whose positions make a slope
/// A plane has three unknowns an axis: twice as many neighbours must agree with it.
constexpr int kLeast = 6;

/// The decoded pixels around one, as a window of offsets −kReach..kReach.
class Window {
 public:
  Window(const RawMap& map, int row, int col) : map_(map), row_(row), col_(col) {}

  bool decoded(int dr, int dc) const {
    const int r = row_ + dr, c = col_ + dc;
    return r >= 0 && r < map_.grid().rows && c >= 0 && c < map_.grid().cols && map_.mask.at(r, c);
  }
  double at(std::size_t axis, int dr, int dc) const {
    return static_cast<double>(map_.position[axis].at(row_ + dr, col_ + dc));
  }

  /// Median change of one axis a camera pixel, downwards or to the right; 0 if no two pixels tell.
  double slope(std::size_t axis, bool down) const {
    std::array<double, std::size_t{2 * kReach + 1} * (2 * kReach + 1)> found{};
    std::size_t count = 0;
    const int dr = down ? kApart : 0, dc = down ? 0 : kApart;
    for (int i = -kReach; i <= kReach - dr; ++i)
      for (int j = -kReach; j <= kReach - dc; ++j)
        if (decoded(i, j) && decoded(i + dr, j + dc))
          found[count++] = (at(axis, i + dr, j + dc) - at(axis, i, j)) / kApart;
    if (count == 0) return 0;
    double* const middle = found.data() + count / 2;
    std::nth_element(found.data(), middle, found.data() + count);
    return *middle;
  }

 private:
  const RawMap& map_;
  int row_, col_;
};

bool supported(const RawMap& map, int row, int col, const DecodePolicy& policy) {
  const Window window(map, row, col);
  std::array<double, 2> down{}, right{};
  for (std::size_t axis = 0; axis < 2; ++axis)
    down[axis] = window.slope(axis, true), right[axis] = window.slope(axis, false);
  int decoded = 0, agreeing = 0;
  for (int i = -kReach; i <= kReach; ++i)
    for (int j = -kReach; j <= kReach; ++j) {
      if ((i == 0 && j == 0) || !window.decoded(i, j)) continue;
      const auto off = [&](std::size_t axis) {
        return window.at(axis, i, j) - down[axis] * i - right[axis] * j - window.at(axis, 0, 0);
      };
      ++decoded;
      agreeing += std::hypot(off(0), off(1)) <= policy.support_distance ? 1 : 0;
    }
  return agreeing >= kLeast && agreeing >= policy.support_share * decoded;
}

}  // namespace

void drop_unsupported(RawMap& map, const DecodePolicy& policy) {
  Image<std::uint8_t> kept(map.grid());
  tbb::parallel_for(0, map.grid().rows, [&](int row) {
    for (int col = 0; col < map.grid().cols; ++col)
      kept.at(row, col) = map.mask.at(row, col) && supported(map, row, col, policy) ? 1 : 0;
  });
  map.mask = std::move(kept);
}

}  // namespace symrig::calibration
