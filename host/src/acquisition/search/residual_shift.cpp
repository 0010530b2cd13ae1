// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/residual_shift.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

/// One channel of a photograph in raster order.
struct Raster {
  std::vector<float> mean, variance;
  std::vector<std::uint8_t> valid;
};

/// The squared contrast of each pixel of a view to its neighbours, times `share`.
void contrast(const Tile& view, int stride, float share, Raster& raster) {
  for (int row = 0; row < view.grid.rows; ++row)
    for (int col = 0; col < view.grid.cols; ++col) {
      const std::size_t i = static_cast<std::size_t>(view.row + row) * stride + view.col + col;
      float squares = 0;
      const auto add = [&](bool has_neighbour, std::size_t n) {
        if (!has_neighbour || raster.valid[n] == 0) return;
        const float difference = raster.mean[i] - raster.mean[n];
        squares += difference * difference;
      };
      add(row > 0, i - stride);
      add(row + 1 < view.grid.rows, i + stride);
      add(col > 0, i - 1);
      add(col + 1 < view.grid.cols, i + 1);
      raster.variance[i] = raster.valid[i] != 0 ? share * squares : 0;
    }
}

void add_to(TreePhotograph& photograph, const BlockTree& tree, float share) {
  const std::size_t pixels = tree.order().size();
  const Grid grid = tree.grid();
  const ViewLayout views = tree.views();
  Raster raster{std::vector<float>(pixels), std::vector<float>(pixels), std::vector<std::uint8_t>(pixels)};
  for (std::size_t begin = 0; begin < photograph.mean.size(); begin += pixels) {
    for (std::size_t t = 0; t < pixels; ++t) {
      raster.mean[tree.order()[t]] = photograph.mean[begin + t];
      raster.valid[tree.order()[t]] = photograph.valid[begin + t];
    }
    for (int row = 0; row < views.rows; ++row)
      for (int col = 0; col < views.cols; ++col)
        contrast(views.tile(grid, {row, col}), grid.cols, share, raster);
    for (std::size_t t = 0; t < pixels; ++t)
      photograph.variance[begin + t] += raster.variance[tree.order()[t]];
  }
}

}  // namespace

void add_shift_variance(const BlockTree& tree, double sigma, std::span<TreePhotograph> photographs) {
  if (!(sigma > 0)) return;
  const auto share = static_cast<float>(sigma * sigma / 2);
  tbb::parallel_for(std::size_t{0}, photographs.size(),
                    [&](std::size_t k) { add_to(photographs[k], tree, share); });
}

}  // namespace symrig::acquisition
