// SPDX-License-Identifier: Apache-2.0
#include "calibration/raw_map.hpp"
#include "calibration/small_median.hpp"

#include <array>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

constexpr int kSlopeReach = 3;  // 7 × 7 pixels are used
constexpr int kSlopeApart = 3;  // camera pixels between the two positions of a slope
/// A plane has three unknowns for each axis; twice as many neighbours must agree with it.
constexpr int kLeast = 6;

/// The decoded pixels around one, as a window of offsets −kSlopeReach..kSlopeReach.
class Window {
  static constexpr int kSide = 2 * kSlopeReach + 1;
  static constexpr std::size_t kPixels = std::size_t{kSide} * kSide;

 public:
  void read(const RawMap& map, int row, int col) {
    const Grid grid = map.grid();
    std::size_t at = 0;
    for (int r = row - kSlopeReach; r <= row + kSlopeReach; ++r)
      for (int c = col - kSlopeReach; c <= col + kSlopeReach; ++c, ++at) {
        decoded_[at] = r >= 0 && r < grid.rows && c >= 0 && c < grid.cols && map.mask.at(r, c) != 0;
        if (!decoded_[at]) continue;
        for (std::size_t axis = 0; axis < 2; ++axis) position_[axis][at] = map.position[axis].at(r, c);
      }
  }

  bool decoded(int dr, int dc) const { return decoded_[index(dr, dc)]; }
  float at(std::size_t axis, int dr, int dc) const { return position_[axis][index(dr, dc)]; }

  /// Median change of one axis for each camera pixel, downwards or to the right; 0 if no two pixels give it.
  double slope(std::size_t axis, bool down) const {
    SmallMedian<std::size_t{kSide} * (kSide - kSlopeApart)> changes;
    const int dr = down ? kSlopeApart : 0, dc = down ? 0 : kSlopeApart;
    for (int i = -kSlopeReach; i <= kSlopeReach - dr; ++i)
      for (int j = -kSlopeReach; j <= kSlopeReach - dc; ++j)
        if (decoded(i, j) && decoded(i + dr, j + dc)) changes.add(at(axis, i + dr, j + dc) - at(axis, i, j));
    return changes.count() == 0 ? 0 : static_cast<double>(changes.value()) / kSlopeApart;
  }

 private:
  static std::size_t index(int dr, int dc) {
    const int at = (dr + kSlopeReach) * kSide + dc + kSlopeReach;
    return static_cast<std::size_t>(at);
  }

  std::array<bool, kPixels> decoded_{};
  std::array<std::array<float, kPixels>, 2> position_{};
};

bool supported(const Window& window, const DecodePolicy& policy) {
  std::array<double, 2> down{}, right{};
  for (std::size_t axis = 0; axis < 2; ++axis)
    down[axis] = window.slope(axis, true), right[axis] = window.slope(axis, false);
  int decoded = 0, agreeing = 0;
  const double farthest = policy.support_distance * policy.support_distance;
  for (int i = -kSlopeReach; i <= kSlopeReach; ++i)
    for (int j = -kSlopeReach; j <= kSlopeReach; ++j) {
      if ((i == 0 && j == 0) || !window.decoded(i, j)) continue;
      const auto off = [&](std::size_t axis) {
        return static_cast<double>(window.at(axis, i, j)) - down[axis] * i - right[axis] * j -
               static_cast<double>(window.at(axis, 0, 0));
      };
      const double x = off(0), y = off(1);
      ++decoded;
      agreeing += x * x + y * y <= farthest ? 1 : 0;
    }
  return agreeing >= kLeast && agreeing >= policy.support_share * decoded;
}

}  // namespace

void drop_unsupported(RawMap& map, const DecodePolicy& policy) {
  Image<std::uint8_t> kept(map.grid());
  tbb::parallel_for(0, map.grid().rows, [&](int row) {
    Window window;
    for (int col = 0; col < map.grid().cols; ++col) {
      if (!map.mask.at(row, col)) continue;
      window.read(map, row, col);
      kept.at(row, col) = supported(window, policy) ? 1 : 0;
    }
  });
  map.mask = std::move(kept);
}

}  // namespace symrig::calibration
