// SPDX-License-Identifier: Apache-2.0
#include "calibration/pixel_map/raw_map.hpp"
#include "symrig/base/statistics.hpp"

#include <vector>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// det ∂(col, row) / ∂(camera col, camera row).
double determinant(const PositionPlane& col, const PositionPlane& row) {
  return col.by_col * row.by_row - col.by_row * row.by_col;
}

/// Both planes around a pixel, over neighbours of the same block.
struct LocalMap {
  std::array<PositionPlane, 2> plane;
  double determinant() const {
    return plane[0].support > 0 && plane[1].support > 0 ? calibration::determinant(plane[0], plane[1]) : 0;
  }
};

template <class Same>
LocalMap local_map(const RawMap& map, int row, int col, const Neighbourhood& hood, Same same) {
  LocalMap local;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto& position = map.position[axis];
    local.plane[axis] =
        fit_plane(position, map.mask, row, col, static_cast<double>(position.at(row, col)), hood, same);
  }
  return local;
}

/// One of the two candidates at a pixel, with the direction of the map there.
struct Choice {
  bool settled = false;
  float position = 0;
  double by_col = 0, by_row = 0;
};

/// Reflections inside blocks of one axis.
class Folded {
 public:
  Folded(const RawMap& map, StripeAxis axis, int block)
      : position_(map.position[axis_index(axis)]), block_(block) {}

  float candidate(int row, int col) const { return position_.at(row, col); }
  float reflected(int row, int col) const {
    return static_cast<float>(2 * block_number(row, col) * block_ + block_ - 1) - candidate(row, col);
  }
  int block_number(int row, int col) const {
    return static_cast<int>(std::floor((candidate(row, col) + 0.5F) / static_cast<float>(block_)));
  }
  /// The middle of the block: the known part of a position without the bit.
  float middle(int row, int col) const {
    return static_cast<float>(block_number(row, col) * block_) + static_cast<float>(block_ - 1) / 2;
  }

 private:
  const Image<float>& position_;
  int block_;
};

/// Away from the folds, chooses the candidate whose map keeps the orientation. At a fold, or in a small
/// neighbourhood, the determinant is far below the usual one, and the pixel waits for its neighbours.
std::vector<Choice> settle_by_orientation(const RawMap& map, const Folded& folded, StripeAxis axis,
                                          const Neighbourhood& hood, double orientation) {
  const Grid grid = map.grid();
  std::vector<Choice> choices(grid.size());
  std::vector<double> size(choices.size(), 0);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col) {
      if (!map.mask.at(row, col)) continue;
      const int block = folded.block_number(row, col);
      const LocalMap local =
          local_map(map, row, col, hood, [&](int r, int c) { return folded.block_number(r, c) == block; });
      const std::size_t i =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.cols) + static_cast<std::size_t>(col);
      const bool keep = local.determinant() * orientation > 0;
      const double sign = keep ? 1 : -1;
      const PositionPlane& plane = local.plane[axis_index(axis)];
      size[i] = std::abs(local.determinant());
      choices[i] = {size[i] > 0, keep ? folded.candidate(row, col) : folded.reflected(row, col),
                    sign * plane.by_col, sign * plane.by_row};
    }
  });
  std::vector<double> sizes;
  std::ranges::copy_if(size, std::back_inserter(sizes), [](double s) { return s > 0; });
  const double usual = quantile(sizes, 0.5);
  for (std::size_t i = 0; i < choices.size(); ++i) choices[i].settled = size[i] > 0.5 * usual;
  return choices;
}

/// For blocks that are too narrow to show the direction of the map. Chooses the candidate nearer to a plane
/// through the middles of the blocks around, over about four blocks.
std::vector<Choice> settle_by_blocks(const RawMap& map, const Folded& folded, int block, double scale) {
  const Grid grid = map.grid();
  constexpr int kVoteReach = 6;
  Image<float> middles(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      if (map.mask.at(row, col)) middles.at(row, col) = folded.middle(row, col);
  const int spacing = std::max(1, static_cast<int>(std::lround(2 * block / scale / kVoteReach)));
  const Neighbourhood hood{.reach = kVoteReach, .spacing = spacing, .scale = scale, .least = 20};
  std::vector<Choice> choices(grid.size());
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col) {
      if (!map.mask.at(row, col)) continue;
      const PositionPlane plane =
          fit_plane(middles, map.mask, row, col, static_cast<double>(middles.at(row, col)), hood,
                    [](int, int) { return true; });
      if (plane.support == 0) continue;
      const float a = folded.candidate(row, col), b = folded.reflected(row, col);
      const bool keep =
          std::abs(static_cast<double>(a) - plane.value) <= std::abs(static_cast<double>(b) - plane.value);
      choices[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.cols) +
              static_cast<std::size_t>(col)] = {true, keep ? a : b, plane.by_col, plane.by_row};
    }
  });
  return choices;
}

/// The prediction of settled neighbours for a pixel; NaN if there are too few.
double predicted_position(const std::vector<Choice>& choices, Grid grid, int row, int col, int reach,
                          int spacing) {
  thread_local std::vector<double> votes;
  votes.clear();
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      const int r = row + i * spacing, c = col + j * spacing;
      if (r < 0 || r >= grid.rows || c < 0 || c >= grid.cols) continue;
      const Choice& q = choices[static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.cols) +
                                static_cast<std::size_t>(c)];
      if (q.settled)
        votes.push_back(static_cast<double>(q.position) - q.by_col * j * spacing - q.by_row * i * spacing);
    }
  }
  return votes.size() < 6 ? std::numeric_limits<double>::quiet_NaN() : quantile(votes, 0.5);
}

}  // namespace

double typical_scale(const RawMap& map) {
  constexpr int kSpan = 8, kStride = 5;
  const Grid grid = map.grid();
  std::vector<double> slopes;
  for (int row = 0; row + kSpan < grid.rows; row += kStride) {
    for (int col = 0; col + kSpan < grid.cols; col += kStride) {
      if (!map.mask.at(row, col) || !map.mask.at(row, col + kSpan) || !map.mask.at(row + kSpan, col))
        continue;
      double largest = 0;
      for (const auto& position : map.position)
        largest = std::max(
            {largest, std::abs(static_cast<double>(position.at(row, col + kSpan) - position.at(row, col))),
             std::abs(static_cast<double>(position.at(row + kSpan, col) - position.at(row, col)))});
      slopes.push_back(largest / kSpan);
    }
  }
  return slopes.empty() ? 1 : quantile(slopes, 0.5);
}

// Without Gray bit k, a position and its reflection in a block of `block` pixels have the same code. The
// steps:
// 1. A first choice for each pixel. Wide blocks: both candidates' planes around the pixel have opposite
//    determinants det ∂(col, row) / ∂(camera), and a surface keeps `orientation`. Narrow blocks: the
//    candidate nearer to a plane through the middles of the blocks around.
// 2. Pixels near a fold, where the determinant is small, wait. All pixels then choose again, by the median
//    of what settled neighbours predict; first near ones, then farther ones.
// 3. A pixel that neither candidate brings within a pixel of the prediction leaves the mask.
void unfold(RawMap& map, StripeAxis axis, int block, double orientation) {
  const Grid grid = map.grid();
  const double scale = typical_scale(map);
  // The window that shows the direction of the map must fit into half a block.
  const int spacing = std::clamp(static_cast<int>(std::lround(block / scale / 12)), 1, 3);
  const Neighbourhood hood{.spacing = spacing, .scale = scale};
  const Folded folded(map, axis, block);
  constexpr double kOff = 1;      // projector pixels
  constexpr double kNarrow = 10;  // camera pixels
  const bool narrow = block < kNarrow * scale;
  const auto choices = narrow ? settle_by_blocks(map, folded, block, scale)
                              : settle_by_orientation(map, folded, axis, hood, orientation);
  Image<float> unfolded(grid);
  Image<std::uint8_t> settled(grid);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col) {
      if (!map.mask.at(row, col)) continue;
      double expected = predicted_position(choices, grid, row, col, 2, hood.spacing);
      if (std::isnan(expected)) expected = predicted_position(choices, grid, row, col, 3, 3 * hood.spacing);
      if (std::isnan(expected)) continue;
      const float a = folded.candidate(row, col), b = folded.reflected(row, col);
      const bool keep =
          std::abs(static_cast<double>(a) - expected) <= std::abs(static_cast<double>(b) - expected);
      unfolded.at(row, col) = keep ? a : b;
      // Neither candidate: another surface begins here, or the surface bends light as ribbed tape does.
      if (std::abs(static_cast<double>(unfolded.at(row, col)) - expected) > kOff) continue;
      settled.at(row, col) = 1;
    }
  });
  map.position[axis_index(axis)] = std::move(unfolded);
  map.mask = std::move(settled);
}

double oriented_share(const RawMap& map, double orientation) {
  constexpr int kStride = 7;
  const Grid grid = map.grid();
  const Neighbourhood hood{.scale = typical_scale(map)};
  std::int64_t known = 0, kept = 0;
  for (int row = 0; row < grid.rows; row += kStride) {
    for (int col = 0; col < grid.cols; col += kStride) {
      if (!map.mask.at(row, col)) continue;
      const double det = local_map(map, row, col, hood, [](int, int) { return true; }).determinant();
      known += det != 0 ? 1 : 0;
      kept += det * orientation > 0 ? 1 : 0;
    }
  }
  return known == 0 ? 0 : static_cast<double>(kept) / static_cast<double>(known);
}

}  // namespace symrig::calibration
