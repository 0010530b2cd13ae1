// SPDX-License-Identifier: Apache-2.0
#include "calibration/raw_map.hpp"
#include "calibration/support_kernels.hpp"

#include <limits>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// A plane has three unknowns for each axis; twice as many neighbours must agree with it.
constexpr float kLeast = 6;
/// Vectors of pixels may end this far behind a row.
constexpr int kBehind = 16;

/// Positions of one axis with a border of NaN, and NaN where nothing is decoded.
Image<float> padded(const RawMap& map, std::size_t axis) {
  const Grid grid = map.grid();
  Image<float> out({grid.rows + 2 * kSupportReach, grid.cols + 2 * kSupportReach + kBehind}, 1,
                   std::numeric_limits<float>::quiet_NaN());
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col)
      if (map.mask.at(row, col))
        out.at(row + kSupportReach, col + kSupportReach) = map.position[axis].at(row, col);
  });
  return out;
}

}  // namespace

void drop_unsupported(RawMap& map, const DecodePolicy& policy) {
  const Grid grid = map.grid();
  const Image<float> col = padded(map, 0), row = padded(map, 1);
  const auto farthest = static_cast<float>(policy.support_distance * policy.support_distance);
  const auto share = static_cast<float>(policy.support_share);
  tbb::parallel_for(tbb::blocked_range<int>(0, grid.rows), [&](const tbb::blocked_range<int>& range) {
    std::vector<Support> support(static_cast<std::size_t>(grid.cols));
    for (int r = range.begin(); r != range.end(); ++r) {
      const auto first =
          static_cast<std::size_t>(r + kSupportReach) * static_cast<std::size_t>(col.grid().cols) +
          std::size_t{kSupportReach};
      count_support(col.values().data() + first, row.values().data() + first, col.grid().cols, support.size(),
                    farthest, support.data());
      for (int c = 0; c < grid.cols; ++c) {
        const Support& s = support[static_cast<std::size_t>(c)];
        if (s.agreeing < kLeast || s.agreeing < share * s.decoded) map.mask.at(r, c) = 0;
      }
    }
  });
}

}  // namespace symrig::calibration
