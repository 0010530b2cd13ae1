// SPDX-License-Identifier: Apache-2.0
#include "tensor/store.hpp"

#include "symrig/tensor/internal/kernels.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace symrig::tensor {
namespace {

std::int64_t blocks(const BlockTree& tree, int level) {
  return level < tree.levels() ? std::ssize(tree.level(level)) : 1;
}

template <class T>
std::int64_t bytes_of(const std::vector<T>& values) {
  return static_cast<std::int64_t>(values.size() * sizeof(T));
}

}  // namespace

Store::Store(Draft&& draft, const TransportTensor& shape)
    : leaves(std::move(draft.leaves)), columns(std::move(draft.columns)) {
  leaves.shrink_to_fit();
  if (draft.ready)
    parts = *std::move(draft.ready);
  else if (draft.packing)
    parts = std::move(*draft.packing).finish();
  else
    parts = LeafParts(
        leaves, draft.factors,
        {shape.camera_grid().size(), shape.projector_grid().size(), shape.symmetric(), shape.channels()});
  draft.factors = {};
  add_scalars(draft, shape);
  for (const BandLeaf& band : draft.bands)
    bands.emplace_back(shape.camera_grid(), shape.channels(), band.radius, band.values);
  for (std::size_t l = 0; l < draft.empties.size(); ++l)
    empties.emplace_back(draft.empties[l], blocks(shape.projector_tree(), static_cast<int>(l)));
}

void Store::add_scalars(const Draft& draft, const TransportTensor& shape) {
  const std::size_t channels = shape.channels();
  std::vector<ScalarLeaf> at, mirrored;
  std::vector<float> values;
  for (std::size_t k = 0; k < draft.scalars.size(); ++k) {
    const auto [row, col] = draft.scalars[k];
    const auto of_scalar = std::span(draft.scalar_values).subspan(k * channels, channels);
    if (shape.symmetric() && row == col) {
      if (diagonal.empty()) diagonal = Diagonal(shape.camera_grid().size(), shape.channels());
      diagonal.add(row, of_scalar);
      continue;
    }
    at.push_back({row, col});
    mirrored.push_back({col, row});
    values.insert(values.end(), of_scalar.begin(), of_scalar.end());
  }
  if (shape.symmetric()) {
    const std::vector<float> once = values;
    at.insert(at.end(), mirrored.begin(), mirrored.end());
    values.insert(values.end(), once.begin(), once.end());
  } else {
    entries[1] = Entries(mirrored, values, shape.channels());
  }
  entries[0] = Entries(at, values, shape.channels());
}

std::int64_t Store::bytes() const {
  std::int64_t total = bytes_of(leaves) + parts.bytes() + diagonal.bytes() + entries[0].bytes() +
                       entries[1].bytes() + columns.bytes();
  for (const Band& band : bands) total += band.bytes();
  for (const EmptyList& level : empties) total += level.bytes();
  return total;
}

template <std::size_t Width>
void MeasuredColumns::apply(int channels, int channel, bool transposed, const float* p, float* y) const {
  const auto value = [&](std::int64_t entry) {
    return values[static_cast<std::size_t>(entry) * static_cast<std::size_t>(channels) +
                  static_cast<std::size_t>(channel)];
  };
  for (const SparseColumn& column : ranges) {
    const auto begin = static_cast<std::size_t>(column.col_begin),
               end = static_cast<std::size_t>(column.col_end);
    for (std::size_t lane = 0; lane < Width; ++lane) {
      if (transposed) {
        float seen = 0;
        for (std::int64_t e = column.first; e < column.last; ++e)
          seen += p[static_cast<std::size_t>(rows[e]) * Width + lane] * value(e);
        for (std::size_t j = begin; j < end; ++j) y[j * Width + lane] += seen;
        continue;
      }
      double sum = 0;
      for (std::size_t j = begin; j < end; ++j) sum += p[j * Width + lane];
      const auto light = static_cast<float>(sum);
      if (light == 0.0F) continue;
      for (std::int64_t e = column.first; e < column.last; ++e)
        y[static_cast<std::size_t>(rows[e]) * Width + lane] += light * value(e);
    }
  }
}

template void MeasuredColumns::apply<1>(int, int, bool, const float*, float*) const;
template void MeasuredColumns::apply<kBatch>(int, int, bool, const float*, float*) const;

std::int64_t MeasuredColumns::bytes() const {
  return bytes_of(ranges) + bytes_of(rows) + bytes_of(values);
}

}  // namespace symrig::tensor
