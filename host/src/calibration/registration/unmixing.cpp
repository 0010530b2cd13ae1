// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/unmixing.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

constexpr int kRounds = 24;

/// Replaces each pixel that is not valid by the mean of the valid ones beside it.
void fill(Grid grid, std::span<const std::uint8_t> valid, std::span<float> pixels) {
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const auto here = static_cast<std::size_t>(std::int64_t{row} * grid.cols + col);
      if (valid[here]) continue;
      float sum = 0, count = 0;
      const auto add = [&](bool inside, std::size_t there) {
        if (inside && valid[there]) sum += pixels[there], ++count;
      };
      add(row > 0, here - static_cast<std::size_t>(grid.cols));
      add(row + 1 < grid.rows, here + static_cast<std::size_t>(grid.cols));
      add(col > 0, here - 1);
      add(col + 1 < grid.cols, here + 1);
      pixels[here] = count > 0 ? sum / count : 0;
    }
}

}  // namespace

void unmix(Grid grid, Point shift, std::span<const float> pixels, std::span<const std::uint8_t> valid,
           std::span<float> cells) {
  const int down = shift.row < 0 ? -1 : 1, right = shift.col < 0 ? -1 : 1;
  const auto far_row = static_cast<float>(std::abs(shift.row)),
             far_col = static_cast<float>(std::abs(shift.col));
  std::vector<float> wanted(pixels.begin(), pixels.end());
  fill(grid, valid, wanted);
  std::vector<float> now(wanted), next(wanted);
  for (int round = 0; round < kRounds; ++round) {
    const auto at = [&](int row, int col) {
      return row < 0 || col < 0 || row >= grid.rows || col >= grid.cols
                 ? 0.F
                 : now[static_cast<std::size_t>(std::int64_t{row} * grid.cols + col)];
    };
    tbb::parallel_for(0, grid.rows, [&](int row) {
      for (int col = 0; col < grid.cols; ++col) {
        const auto here = static_cast<std::size_t>(std::int64_t{row} * grid.cols + col);
        const float near = (1 - far_col) * now[here] + far_col * at(row, col + right);
        const float other = (1 - far_col) * at(row + down, col) + far_col * at(row + down, col + right);
        next[here] = now[here] + wanted[here] - ((1 - far_row) * near + far_row * other);
      }
    });
    now.swap(next);
  }
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = valid[i] ? now[i] : 0.F;
}

/// Σ of the squares of the inverse's rows, far from the border: along an axis, 1 / ((1 − s)² − s²).
double unmixed_noise(Point shift) {
  const auto axis = [](double s) { return 1 / (1 - 2 * std::abs(s)); };
  return axis(shift.row) * axis(shift.col);
}

}  // namespace symrig::calibration
