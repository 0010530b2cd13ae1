// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/transport_tensor.hpp"

#include "tensor/kernels.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace symrig {
namespace {

using tensor::LitRanges;

double sum(std::span<const float> values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

}  // namespace

void TransportTensor::apply_leaves(std::span<const float> p, std::span<float> y, int channel,
                                   bool transposed) const {
  const LitRanges lit(p);
  for (const Leaf& leaf : leaves_) {
    const float* a =
        factors_.data() + leaf.factors + std::int64_t{channel} * leaf.rank * (leaf.rows() + leaf.cols());
    const float* b = a + std::int64_t{leaf.rank} * leaf.rows();
    const bool mirrored = symmetric_ && leaf.row_begin != leaf.col_begin;
    const bool forward = (symmetric_ || !transposed) && lit.any(leaf.col_begin, leaf.col_end);
    const bool backward = (mirrored || (transposed && !symmetric_)) && lit.any(leaf.row_begin, leaf.row_end);
    if (!forward && !backward) continue;
    const auto rows = static_cast<std::size_t>(leaf.rows());
    const auto cols = static_cast<std::size_t>(leaf.cols());
    const float* const p_row = p.data() + leaf.row_begin;
    const float* const p_col = p.data() + leaf.col_begin;
    float* const y_row = y.data() + leaf.row_begin;
    float* const y_col = y.data() + leaf.col_begin;
    // y_I += A (Bᵀ p_J) and y_J += B (Aᵀ p_I)
    for (std::int32_t k = 0; k < leaf.rank; ++k, a += rows, b += cols) {
      if (forward && backward) {
        tensor::add_scaled(tensor::add_scaled_and_dot(tensor::dot(b, p_col, cols), a, p_row, y_row, rows), b,
                           y_col, cols);
      } else if (forward) {
        tensor::add_scaled(tensor::dot(b, p_col, cols), a, y_row, rows);
      } else {
        tensor::add_scaled(tensor::dot(a, p_row, rows), b, y_col, cols);
      }
    }
  }
}

void TransportTensor::apply_scalars(std::span<const float> p, std::span<float> y, int channel,
                                    bool transposed) const {
  for (std::size_t k = 0; k < scalars_.size(); ++k) {
    auto row = static_cast<std::size_t>(scalars_[k].row);
    auto col = static_cast<std::size_t>(scalars_[k].col);
    if (transposed) std::swap(row, col);
    const float value = scalar_values_[value_index(k, channel)];
    y[row] += value * p[col];
    if (symmetric_ && row != col) y[col] += value * p[row];
  }
}

void TransportTensor::apply_columns(std::span<const float> p, std::span<float> y, int channel,
                                    bool transposed) const {
  for (const SparseColumn& column : columns_) {
    const auto begin = static_cast<std::size_t>(column.col_begin);
    const auto wide = static_cast<std::size_t>(column.col_end) - begin;
    if (!transposed) {
      const auto light = static_cast<float>(sum(p.subspan(begin, wide)));
      if (light == 0.0F) continue;
      for (auto e = static_cast<std::size_t>(column.first); e < static_cast<std::size_t>(column.last); ++e)
        y[static_cast<std::size_t>(column_rows_[e])] += light * column_values_[value_index(e, channel)];
    } else {
      float seen = 0;
      for (auto e = static_cast<std::size_t>(column.first); e < static_cast<std::size_t>(column.last); ++e)
        seen += p[static_cast<std::size_t>(column_rows_[e])] * column_values_[value_index(e, channel)];
      for (float& v : y.subspan(begin, wide)) v += seen;
    }
  }
}

void TransportTensor::apply_tree(std::span<const float> p, std::span<float> y, int channel,
                                 bool transposed) const {
  apply_leaves(p, y, channel, transposed);
  apply_scalars(p, y, channel, transposed);
  apply_columns(p, y, channel, transposed);
}

Result<Image<float>> TransportTensor::apply_between(const Image<float>& light, const BlockTree& from,
                                                    const BlockTree& to, bool transposed) const {
  if (light.grid() != from.grid() || light.channels() != 1)
    return Error{ErrorCode::size_mismatch,
                 "light is " + to_string(light.grid()) + " with " + std::to_string(light.channels()) +
                     " channels, the tensor takes " + to_string(from.grid()) + " with 1",
                 "resize the picture to " + to_string(from.grid()) + " (rows x columns)"};
  Image<float> out(to.grid(), channels_);
  std::vector<float> p(static_cast<std::size_t>(from.grid().size()));
  std::vector<float> y(static_cast<std::size_t>(to.grid().size()));
  from.to_tree(light.plane(0), p);
  for (int channel = 0; channel < channels_; ++channel) {
    std::fill(y.begin(), y.end(), 0.0F);
    apply_tree(p, y, channel, transposed);
    to.to_raster(y, out.plane(channel));
  }
  return out;
}

Result<Image<float>> TransportTensor::apply(const Image<float>& pattern) const {
  return apply_between(pattern, projector_tree(), camera_tree(), false);
}

Result<Image<float>> TransportTensor::apply_transposed(const Image<float>& light) const {
  return apply_between(light, camera_tree(), projector_tree(), true);
}

int TransportTensor::scalar_level(const ScalarLeaf& scalar) const {
  return std::max(camera_.pixel_level(scalar.row), projector_tree().pixel_level(scalar.col));
}

std::vector<LeafCounts> TransportTensor::leaves_per_level() const {
  std::vector<LeafCounts> counts(empties_.size());
  for (const Leaf& leaf : leaves_) {
    LeafCounts& at = counts[static_cast<std::size_t>(leaf.level)];
    ++(leaf.rank == 1 ? at.rank1 : at.low_rank);
  }
  for (std::size_t l = 0; l < empties_.size(); ++l) counts[l].empty = std::ssize(empties_[l]);
  for (const ScalarLeaf& scalar : scalars_) ++counts[static_cast<std::size_t>(scalar_level(scalar))].scalar;
  if (!column_rows_.empty()) counts.back().scalar += std::ssize(column_rows_);
  return counts;
}

std::int64_t TransportTensor::bytes() const {
  const auto of = [](const auto& v) { return static_cast<std::int64_t>(v.size() * sizeof(v[0])); };
  std::int64_t total = of(leaves_) + of(factors_) + of(scalars_) + of(scalar_values_) + of(columns_) +
                       of(column_rows_) + of(column_values_);
  for (const auto& level : empties_) total += of(level);
  return total;
}

double TransportTensor::dense_bytes() const {
  return static_cast<double>(camera_grid().size()) * static_cast<double>(projector_grid().size()) *
         channels_ * sizeof(float);
}

}  // namespace symrig
