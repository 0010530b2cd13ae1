// SPDX-License-Identifier: Apache-2.0
#include "calibration/cells/neighbour_light.hpp"

#include <algorithm>
#include <cmath>
#include <span>
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

namespace {

/// Below this variance, samples of a Gaussian have another variance than it. Then three taps have the right
/// one.
constexpr double kNarrow = 0.5;

/// Taps −n … n with sum 1 and the variance width².
std::vector<float> kernel(double width) {
  const double variance = width * width;
  if (variance <= kNarrow)
    return {static_cast<float>(variance / 2), static_cast<float>(1 - variance),
            static_cast<float>(variance / 2)};
  const int reach = static_cast<int>(std::ceil(3.5 * width));
  std::vector<double> taps;
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) sum += taps.emplace_back(std::exp(-0.5 * k * k / variance));
  std::vector<float> out;
  out.reserve(taps.size());
  for (const double tap : taps) out.push_back(static_cast<float>(tap / sum));
  return out;
}

/// Rows that one task blurs: with their neighbours they stay in the cache.
constexpr int kRows = 32;

/// to = taps * from along the rows, then along the columns. Nothing comes from beyond the border.
void convolve(Grid grid, std::span<const float> taps, std::span<const float> from, std::span<float> to) {
  const int reach = static_cast<int>(taps.size()) / 2;
  const auto cols = static_cast<std::size_t>(grid.cols);
  tbb::parallel_for(0, (grid.rows + kRows - 1) / kRows, [&](int block) {
    const int first = block * kRows, last = std::min(first + kRows, grid.rows);
    const int above = std::max(first - reach, 0), below = std::min(last + reach, grid.rows);
    std::vector<float> across(static_cast<std::size_t>(below - above) * cols);
    for (int row = above; row < below; ++row) {
      const float* in = from.data() + static_cast<std::size_t>(row) * cols;
      float* out = across.data() + static_cast<std::size_t>(row - above) * cols;
      for (int k = -reach; k <= reach; ++k) {
        const float tap = taps[k + reach];
        const int begin = std::max(0, -k), end = grid.cols - std::max(0, k);
        for (int col = begin; col < end; ++col) out[col] += tap * in[col + k];
      }
    }
    for (int row = first; row < last; ++row) {
      float* out = to.data() + static_cast<std::size_t>(row) * cols;
      std::fill_n(out, cols, 0.F);
      for (int k = std::max(-reach, -row); k <= std::min(reach, grid.rows - 1 - row); ++k) {
        const float tap = taps[k + reach];
        const float* in = across.data() + static_cast<std::size_t>(row + k - above) * cols;
        for (std::size_t col = 0; col < cols; ++col) out[col] += tap * in[col];
      }
    }
  });
}

/// The light that a pixel near the border gets from inside the picture, along one axis.
std::vector<float> inside(int size, std::span<const float> taps) {
  const int reach = static_cast<int>(taps.size()) / 2;
  std::vector<float> share(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i)
    for (int k = std::max(-reach, -i); k <= std::min(reach, size - 1 - i); ++k)
      share[static_cast<std::size_t>(i)] += taps[k + reach];
  return share;
}

}  // namespace

Radiance blurred(const Radiance& photograph, double width) {
  const Grid grid = photograph.mean.grid();
  const std::vector<float> taps = kernel(width);
  Radiance out = photograph;
  const std::vector<float> down = inside(grid.rows, taps), across = inside(grid.cols, taps);
  std::vector<float> share;
  for (int c = 0; c < photograph.mean.channels(); ++c) {
    // Means are 0 where a pixel is not valid.
    const auto mean = out.mean.plane(c);
    const auto valid = photograph.valid.plane(c);
    convolve(grid, taps, photograph.mean.plane(c), mean);
    const bool all_valid = std::ranges::all_of(valid, [](std::uint8_t v) { return v != 0; });
    if (!all_valid) {
      const std::vector<float> here(valid.begin(), valid.end());
      share.resize(here.size());
      convolve(grid, taps, here, share);
    }
    tbb::parallel_for(0, grid.rows, [&](int row) {
      for (int col = 0; col < grid.cols; ++col) {
        const auto i = static_cast<std::size_t>(std::int64_t{row} * grid.cols + col);
        const float part = all_valid
                               ? down[static_cast<std::size_t>(row)] * across[static_cast<std::size_t>(col)]
                               : share[i];
        mean[i] = valid[i] && part > 0 ? mean[i] / part : 0.F;
      }
    });
  }
  return out;
}

}  // namespace symrig::calibration
