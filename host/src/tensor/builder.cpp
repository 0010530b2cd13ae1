// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/internal/kernels.hpp"
#include "symrig/tensor/transport_tensor.hpp"
#include "tensor/store.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace symrig {
namespace {

/// Sets the values of neighbours outside of the grid to 0.
void darken_off_grid(Grid grid, BandLeaf& band) {
  const std::vector<BandOffset> offsets = band_offsets(band.radius);
  for (std::size_t at = 0; at < band.values.size(); ++at) {
    const auto [dy, dx] = offsets[at / static_cast<std::size_t>(grid.size()) % offsets.size()];
    const auto i = static_cast<int>(at % static_cast<std::size_t>(grid.size()));
    const int row = i / grid.cols + dy, col = i % grid.cols + dx;
    if (row >= grid.rows || col < 0 || col >= grid.cols) band.values[at] = 0;
  }
}

}  // namespace

TensorBuilder::TensorBuilder(BlockTree tree, int channels) : draft_(std::make_shared<tensor::Draft>()) {
  tensor_.camera_ = std::move(tree);
  tensor_.symmetric_ = true;
  tensor_.channels_ = channels;
  tensor_.draft_ = draft_;
  draft_->empties.resize(tensor_.camera_.levels());
}

TensorBuilder::TensorBuilder(BlockTree camera, BlockTree projector, int channels)
    : draft_(std::make_shared<tensor::Draft>()) {
  tensor_.camera_ = std::move(camera);
  tensor_.projector_ = std::move(projector);
  tensor_.symmetric_ = false;
  tensor_.channels_ = channels;
  tensor_.draft_ = draft_;
  draft_->empties.resize(
      static_cast<std::size_t>(std::max(tensor_.camera_.levels(), tensor_.projector_.levels())));
}

void TensorBuilder::add_leaf(std::int32_t row_begin, std::int32_t row_end, std::int32_t col_begin,
                             std::int32_t col_end, int rank, int level, std::span<const float> factors) {
  const Leaf leaf{row_begin, row_end, col_begin, col_end, rank, level};
  assert(rank >= 1 &&
         std::ssize(factors) == std::int64_t{tensor_.channels_} * rank * (leaf.rows() + leaf.cols()));
  if (draft_->packing) draft_->packing->add(leaf, factors);
  draft_->leaves.push_back(leaf);
  if (!draft_->packing) draft_->factors.insert(draft_->factors.end(), factors.begin(), factors.end());
}

void TensorBuilder::pack_leaves() {
  assert(draft_->leaves.empty());
  draft_->packing.emplace(tensor::LowRank::Shape{tensor_.camera_grid().size(),
                                                 tensor_.projector_grid().size(), tensor_.symmetric(),
                                                 tensor_.channels()});
}

void TensorBuilder::take_leaves(std::vector<Leaf> leaves, tensor::LeafParts parts) {
  assert(draft_->leaves.empty());
  draft_->leaves = std::move(leaves);
  draft_->ready = std::move(parts);
}

void TensorBuilder::add_empty(int level, std::int32_t row_block, std::int32_t col_block) {
  draft_->empties[level].push_back({row_block, col_block});
}

void TensorBuilder::add_scalar(std::int32_t row, std::int32_t col, std::span<const float> values) {
  assert(std::ssize(values) == tensor_.channels_);
  draft_->scalars.push_back({row, col});
  draft_->scalar_values.insert(draft_->scalar_values.end(), values.begin(), values.end());
}

void TensorBuilder::add_band(int radius, std::span<const float> values) {
  assert(tensor_.symmetric_ && radius >= 1 &&
         std::ssize(values) ==
             tensor_.channels_ * std::ssize(band_offsets(radius)) * tensor_.camera_grid().size());
  draft_->bands.push_back({radius, {values.begin(), values.end()}});
  darken_off_grid(tensor_.camera_grid(), draft_->bands.back());
}

void TensorBuilder::add_column(std::int32_t col_begin, std::int32_t col_end,
                               std::span<const std::int32_t> rows, std::span<const float> values) {
  assert(!tensor_.symmetric_ && std::ssize(values) == std::ssize(rows) * tensor_.channels_);
  tensor::MeasuredColumns& columns = draft_->columns;
  const auto first = static_cast<std::int64_t>(columns.rows.size());
  columns.rows.insert(columns.rows.end(), rows.begin(), rows.end());
  columns.values.insert(columns.values.end(), values.begin(), values.end());
  columns.ranges.push_back({col_begin, col_end, first, first + std::ssize(rows)});
}

TransportTensor TensorBuilder::finish() && {
  tensor_.store_ = std::make_shared<const tensor::Store>(std::move(*draft_), tensor_);
  tensor_.draft_.reset();
  draft_.reset();
  return std::move(tensor_);
}

}  // namespace symrig

namespace symrig::tensor {

// Applies a tensor under construction leaf by leaf, in floats, without packing and rounding.

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
