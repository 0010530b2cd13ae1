// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cassert>

namespace symrig {

TensorBuilder::TensorBuilder(BlockTree tree, int channels) {
  tensor_.camera_ = std::move(tree);
  tensor_.symmetric_ = true;
  tensor_.channels_ = channels;
  tensor_.empties_.resize(static_cast<std::size_t>(tensor_.camera_.levels()));
}

TensorBuilder::TensorBuilder(BlockTree camera, BlockTree projector, int channels) {
  tensor_.camera_ = std::move(camera);
  tensor_.projector_ = std::move(projector);
  tensor_.symmetric_ = false;
  tensor_.channels_ = channels;
  tensor_.empties_.resize(
      static_cast<std::size_t>(std::max(tensor_.camera_.levels(), tensor_.projector_.levels())));
}

void TensorBuilder::add_leaf(std::int32_t row_begin, std::int32_t row_end, std::int32_t col_begin,
                             std::int32_t col_end, int rank, int level, std::span<const float> factors) {
  const Leaf leaf{row_begin,
                  row_end,
                  col_begin,
                  col_end,
                  rank,
                  level,
                  static_cast<std::int64_t>(tensor_.factors_.size())};
  assert(rank >= 1 &&
         std::ssize(factors) == std::int64_t{tensor_.channels_} * rank * (leaf.rows() + leaf.cols()));
  tensor_.leaves_.push_back(leaf);
  tensor_.factors_.insert(tensor_.factors_.end(), factors.begin(), factors.end());
}

void TensorBuilder::add_empty(int level, std::int32_t row_block, std::int32_t col_block) {
  tensor_.empties_[static_cast<std::size_t>(level)].push_back({row_block, col_block});
}

void TensorBuilder::add_scalar(std::int32_t row, std::int32_t col, std::span<const float> values) {
  assert(std::ssize(values) == tensor_.channels_);
  tensor_.scalars_.push_back({row, col});
  tensor_.scalar_values_.insert(tensor_.scalar_values_.end(), values.begin(), values.end());
}

void TensorBuilder::add_column(std::int32_t col_begin, std::int32_t col_end,
                               std::span<const std::int32_t> rows, std::span<const float> values) {
  assert(!tensor_.symmetric_ && std::ssize(values) == std::ssize(rows) * tensor_.channels_);
  const auto first = static_cast<std::int64_t>(tensor_.column_rows_.size());
  tensor_.column_rows_.insert(tensor_.column_rows_.end(), rows.begin(), rows.end());
  tensor_.column_values_.insert(tensor_.column_values_.end(), values.begin(), values.end());
  tensor_.columns_.push_back({col_begin, col_end, first, first + std::ssize(rows)});
}

TransportTensor TensorBuilder::finish() && {
  tensor_.leaves_.shrink_to_fit();
  tensor_.factors_.shrink_to_fit();
  tensor_.scalars_.shrink_to_fit();
  tensor_.scalar_values_.shrink_to_fit();
  tensor_.columns_.shrink_to_fit();
  tensor_.column_rows_.shrink_to_fit();
  tensor_.column_values_.shrink_to_fit();
  for (auto& level : tensor_.empties_) level.shrink_to_fit();
  return std::move(tensor_);
}

}  // namespace symrig
