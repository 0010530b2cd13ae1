// SPDX-License-Identifier: Apache-2.0
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
