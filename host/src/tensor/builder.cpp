// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cassert>
#include <tuple>

namespace symrig {

TensorBuilder::TensorBuilder(BlockTree tree, int channels) {
  tensor_.camera_ = std::move(tree);
  tensor_.symmetric_ = true;
  tensor_.channels_ = channels;
}

TensorBuilder::TensorBuilder(BlockTree camera, BlockTree projector, int channels) {
  tensor_.camera_ = std::move(camera);
  tensor_.projector_ = std::move(projector);
  tensor_.symmetric_ = false;
  tensor_.channels_ = channels;
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
  assert(std::ssize(factors) == std::int64_t{tensor_.channels_} * rank * (leaf.rows() + leaf.cols()));
  tensor_.leaves_.push_back(leaf);
  tensor_.factors_.insert(tensor_.factors_.end(), factors.begin(), factors.end());
}

void TensorBuilder::add_scalar(std::int32_t row, std::int32_t col, int level, std::span<const float> values) {
  assert(std::ssize(values) == tensor_.channels_);
  scalars_.push_back({row, col, level, static_cast<std::int64_t>(scalar_values_.size())});
  scalar_values_.insert(scalar_values_.end(), values.begin(), values.end());
}

void TensorBuilder::add_column(std::int32_t col_begin, std::int32_t col_end, int level,
                               std::span<const std::int32_t> rows, std::span<const float> values) {
  assert(!tensor_.symmetric_ || col_end == col_begin + 1);
  assert(std::ssize(values) == std::ssize(rows) * tensor_.channels_);
  const auto first = static_cast<std::int64_t>(tensor_.rows_.size());
  tensor_.rows_.insert(tensor_.rows_.end(), rows.begin(), rows.end());
  tensor_.values_.insert(tensor_.values_.end(), values.begin(), values.end());
  tensor_.columns_.push_back(
      {col_begin, col_end, level, first, static_cast<std::int64_t>(tensor_.rows_.size())});
}

void TensorBuilder::absorb_scalars() {
  std::sort(scalars_.begin(), scalars_.end(), [](const Scalar& a, const Scalar& b) {
    return std::tie(a.level, a.col, a.row) < std::tie(b.level, b.col, b.row);
  });
  const auto channels = static_cast<std::size_t>(tensor_.channels_);
  std::vector<std::int32_t> rows;
  std::vector<float> values;
  for (auto it = scalars_.begin(); it != scalars_.end();) {
    const Scalar head = *it;
    rows.clear();
    values.clear();
    for (; it != scalars_.end() && it->col == head.col && it->level == head.level; ++it) {
      rows.push_back(it->row);
      const auto v = std::span(scalar_values_).subspan(static_cast<std::size_t>(it->value), channels);
      values.insert(values.end(), v.begin(), v.end());
    }
    add_column(head.col, head.col + 1, head.level, rows, values);
  }
  scalars_.clear();
  scalar_values_.clear();
}

const TransportTensor& TensorBuilder::current() {
  absorb_scalars();
  return tensor_;
}

TransportTensor TensorBuilder::finish() && {
  absorb_scalars();
  tensor_.leaves_.shrink_to_fit();
  tensor_.factors_.shrink_to_fit();
  tensor_.columns_.shrink_to_fit();
  tensor_.rows_.shrink_to_fit();
  tensor_.values_.shrink_to_fit();
  return std::move(tensor_);
}

}  // namespace symrig
