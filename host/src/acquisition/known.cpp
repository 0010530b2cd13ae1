// SPDX-License-Identifier: Apache-2.0
#include "acquisition/known.hpp"

#include "tensor/kernels.hpp"

#include <algorithm>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {

using tensor::kBatch;

std::int32_t Known::add_leaf(std::int32_t row_begin, std::int32_t row_end, std::int32_t col_begin,
                             std::int32_t col_end, int level, std::span<const float> factors) {
  leaves_.push_back({row_begin, row_end, col_begin, col_end, level, 0, 0, false,
                     static_cast<std::int64_t>(factors_.size())});
  factors_.insert(factors_.end(), factors.begin(), factors.end());
  return static_cast<std::int32_t>(leaves_.size()) - 1;
}

void Known::add_empty(int level, std::int32_t row_block, std::int32_t col_block) {
  empties_.push_back({level, row_block, col_block});
}

void Known::add_scalar(std::int32_t row, std::int32_t col, std::span<const float> values) {
  scalars_.push_back({row, col});
  scalar_values_.insert(scalar_values_.end(), values.begin(), values.end());
}

void Known::rewind(const Mark& mark) {
  leaves_.resize(mark.leaves);
  factors_.resize(mark.factors);
  empties_.resize(mark.empties);
  scalars_.resize(mark.scalars);
  scalar_values_.resize(mark.scalars * static_cast<std::size_t>(channels_));
}

void Known::subtract_from(std::span<TreePhotograph> photographs) const {
  const std::size_t batches = (photographs.size() + kBatch - 1) / kBatch;
  const auto channels = static_cast<std::size_t>(channels_);
  tbb::parallel_for(std::size_t{0}, batches * channels, [&](std::size_t task) {
    const std::size_t first = task / channels * kBatch;
    subtract_batch(photographs.subspan(first, std::min(kBatch, photographs.size() - first)), task % channels);
  });
}

void Known::subtract_batch(std::span<TreePhotograph> batch, std::size_t channel) const {
  const std::size_t pixels = tree_.order().size();
  std::vector<float> p(pixels * kBatch), y(pixels * kBatch);
  std::vector<float> any(pixels);  // lit in any of the patterns
  for (std::size_t k = 0; k < batch.size(); ++k) {
    for (std::size_t t = 0; t < pixels; ++t) {
      p[t * kBatch + k] = batch[k].pattern[t];
      if (batch[k].pattern[t] != 0) any[t] = 1;
    }
  }
  const tensor::LitRanges lit(any);
  for (const KnownLeaf& leaf : leaves_) {
    if (leaf.removed || (!lit.any(leaf.col_begin, leaf.col_end) && !lit.any(leaf.row_begin, leaf.row_end)))
      continue;
    const auto rows = static_cast<std::size_t>(leaf.rows());
    const auto cols = static_cast<std::size_t>(leaf.cols());
    const float* a = factors_.data() + leaf.factors + static_cast<std::int64_t>(channel * (rows + cols));
    tensor::add_leaf_batch({a, a + rows, static_cast<std::size_t>(leaf.row_begin), rows,
                            static_cast<std::size_t>(leaf.col_begin), cols, 1},
                           !leaf.diagonal(), p.data(), y.data());
  }
  for (std::size_t k = 0; k < scalars_.size(); ++k) {
    const auto row = static_cast<std::size_t>(scalars_[k].row) * kBatch;
    const auto col = static_cast<std::size_t>(scalars_[k].col) * kBatch;
    const float value = scalar_values_[k * static_cast<std::size_t>(channels_) + channel];
    for (std::size_t c = 0; c < kBatch; ++c) y[row + c] += value * p[col + c];
    if (row != col)
      for (std::size_t c = 0; c < kBatch; ++c) y[col + c] += value * p[row + c];
  }
  for (std::size_t k = 0; k < batch.size(); ++k)
    for (std::size_t t = 0; t < pixels; ++t) batch[k].mean[channel * pixels + t] -= y[t * kBatch + k];
}

TransportTensor Known::tensor() const {
  TensorBuilder builder(tree_, channels_);
  for (const KnownLeaf& leaf : leaves_) {
    if (leaf.removed) continue;
    const auto size =
        static_cast<std::size_t>(channels_) * static_cast<std::size_t>(leaf.rows() + leaf.cols());
    builder.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, 1, leaf.level,
                     std::span(factors_).subspan(static_cast<std::size_t>(leaf.factors), size));
  }
  for (const Empty& empty : empties_) builder.add_empty(empty.level, empty.row_block, empty.col_block);
  for (std::size_t k = 0; k < scalars_.size(); ++k)
    builder.add_scalar(
        scalars_[k].row, scalars_[k].col,
        std::span(scalar_values_)
            .subspan(k * static_cast<std::size_t>(channels_), static_cast<std::size_t>(channels_)));
  return std::move(builder).finish();
}

}  // namespace symrig::acquisition
