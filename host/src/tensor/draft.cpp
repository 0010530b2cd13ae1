// SPDX-License-Identifier: Apache-2.0
// Applies a tensor under construction leaf by leaf, in floats, without packing and rounding.
#include "tensor/kernels.hpp"
#include "tensor/store.hpp"

#include <utility>

namespace symrig::tensor {
namespace {

struct Applied {
  const Draft& draft;
  const TransportTensor& shape;
  std::size_t channel, channels;
  bool transposed;
  std::span<const float> p;
  std::span<float> y;

  /// y_I += A (Bᵀ p_J) and y_J += B (Aᵀ p_I). A general tensor needs only one of them.
  void leaf(const Leaf& leaf, const float* a, const float* b, const LitRanges& lit) const {
    const bool mirrored = shape.symmetric() && leaf.row_begin != leaf.col_begin;
    const bool forward = (shape.symmetric() || !transposed) && lit.any(leaf.col_begin, leaf.col_end);
    const bool backward =
        (mirrored || (transposed && !shape.symmetric())) && lit.any(leaf.row_begin, leaf.row_end);
    const auto rows = static_cast<std::size_t>(leaf.rows()), cols = static_cast<std::size_t>(leaf.cols());
    for (std::int32_t k = 0; k < leaf.rank; ++k, a += rows, b += cols) {
      if (forward) add_scaled(dot(b, p.data() + leaf.col_begin, cols), a, y.data() + leaf.row_begin, rows);
      if (backward) add_scaled(dot(a, p.data() + leaf.row_begin, rows), b, y.data() + leaf.col_begin, cols);
    }
  }

  void leaves() const {
    const LitRanges lit(p);
    const float* at = draft.factors.data();
    for (const Leaf& one : draft.leaves) {
      const auto size =
          static_cast<std::size_t>(one.rank) * static_cast<std::size_t>(one.rows() + one.cols());
      const float* const a = at + channel * size;
      leaf(one, a, a + static_cast<std::size_t>(one.rank) * static_cast<std::size_t>(one.rows()), lit);
      at += channels * size;
    }
  }

  void scalars() const {
    for (std::size_t k = 0; k < draft.scalars.size(); ++k) {
      auto row = static_cast<std::size_t>(draft.scalars[k].row);
      auto col = static_cast<std::size_t>(draft.scalars[k].col);
      if (transposed) std::swap(row, col);
      const float value = draft.scalar_values[k * channels + channel];
      y[row] += value * p[col];
      if (shape.symmetric() && row != col) y[col] += value * p[row];
    }
  }

  void bands() const {
    if (draft.bands.empty()) return;
    const BlockTree& tree = shape.camera_tree();
    const Grid grid = tree.grid();
    const std::size_t pixels = p.size();
    std::vector<float> light(pixels), seen(pixels), in_tree(pixels);
    tree.to_raster(p, light);
    for (const BandLeaf& band : draft.bands)
      for (int row = 0; row < grid.rows; ++row)
        for (int col = 0; col < grid.cols; ++col) band_pixel(band, grid, row, col, light, seen);
    tree.to_tree(seen, in_tree);
    for (std::size_t i = 0; i < pixels; ++i) y[i] += in_tree[i];
  }

  void band_pixel(const BandLeaf& band, Grid grid, int row, int col, std::span<const float> light,
                  std::span<float> seen) const {
    const std::vector<BandOffset> offsets = band_offsets(band.radius);
    const std::size_t pixels = light.size(), i = static_cast<std::size_t>(row) * grid.cols + col;
    for (std::size_t k = 0; k < offsets.size(); ++k) {
      const int r = row + offsets[k].dy, c = col + offsets[k].dx;
      if (r >= grid.rows || c < 0 || c >= grid.cols) continue;
      const std::size_t j = static_cast<std::size_t>(r) * grid.cols + c;
      const float value = band.values[(channel * offsets.size() + k) * pixels + i];
      seen[i] += value * light[j];
      seen[j] += value * light[i];
    }
  }
};

}  // namespace

void Draft::apply(const TransportTensor& shape, int channel, bool transposed, std::span<const float> p,
                  std::span<float> y) const {
  const Applied applied{
      *this, shape, static_cast<std::size_t>(channel), static_cast<std::size_t>(shape.channels()), transposed,
      p,     y};
  applied.leaves();
  applied.scalars();
  columns.apply<1>(shape.channels(), channel, transposed, p.data(), y.data());
  applied.bands();
}

}  // namespace symrig::tensor
