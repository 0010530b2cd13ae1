// SPDX-License-Identifier: Apache-2.0
#include "sim/transport.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace symrig::sim {

namespace {

void blur_along_row(std::span<float> row, float a) {
  float before = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const float here = row[i];
    const float after = i + 1 < row.size() ? row[i + 1] : 0.F;
    row[i] = (1 - 2 * a) * here + a * (before + after);
    before = here;
  }
}

void blur_across_rows(Grid grid, std::span<float> image, float a) {
  const std::size_t cols = grid.cols;
  std::vector<float> before(cols, 0.F);
  const std::vector<float> dark(cols, 0.F);
  for (int row = 0; row < grid.rows; ++row) {
    float* here = &image[static_cast<std::size_t>(row) * cols];
    const float* after = row + 1 < grid.rows ? here + cols : dark.data();
    for (std::size_t i = 0; i < cols; ++i) {
      const float value = here[i];
      here[i] = (1 - 2 * a) * value + a * (before[i] + after[i]);
      before[i] = value;
    }
  }
}

}  // namespace

void blur_3tap(Grid grid, float a, std::span<float> image) {
  const std::size_t cols = grid.cols;
  for (std::size_t row = 0; row < static_cast<std::size_t>(grid.rows); ++row)
    blur_along_row(image.subspan(row * cols, cols), a);
  blur_across_rows(grid, image, a);
}

}  // namespace symrig::sim
