// SPDX-License-Identifier: Apache-2.0
// The data of a tensor: during construction (floats, in the order of arrival) and finished (packed).
#pragma once

#include "symrig/tensor/transport_tensor.hpp"
#include "tensor/entries.hpp"
#include "tensor/leaf_parts.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace symrig::tensor {

/// Measured columns, as floats. A tensor with them has nothing else.
struct MeasuredColumns {
  std::vector<SparseColumn> ranges;
  std::vector<std::int32_t> rows;
  std::vector<float> values;  ///< [entry * channels + channel]

  /// y += T p over these columns (or Tᵀ p). Width patterns interleaved.
  template <std::size_t Width>
  void apply(int channels, int channel, bool transposed, const float* p, float* y) const;
  std::int64_t bytes() const;
};

/// A tensor under construction.
struct Draft {
  std::vector<Leaf> leaves;
  std::optional<LeafParts> ready;      ///< of all leaves, in place of factors
  std::optional<LeafPacking> packing;  ///< in place of factors
  std::vector<float> factors;          ///< leaf after leaf, in the order of TensorBuilder::add_leaf
  std::vector<std::vector<EmptyLeaf>> empties;
  std::vector<ScalarLeaf> scalars;
  std::vector<float> scalar_values;  ///< [scalar * channels + channel]
  std::vector<BandLeaf> bands;
  MeasuredColumns columns;

  /// y += T p in tree order, leaf by leaf.
  void apply(const TransportTensor& shape, int channel, bool transposed, std::span<const float> p,
             std::span<float> y) const;
};

/// A finished tensor: the sum of leaves, entries and bands, which may overlap.
struct Store {
  Store() = default;
  Store(Draft&& draft, const TransportTensor& shape);

  std::vector<Leaf> leaves;
  LeafParts parts;  ///< of the leaves
  Diagonal diagonal;
  /// Off-diagonal entries, sorted by the pixel that sees: camera pixels, and projector pixels for Tᵀ. If
  /// symmetric, the first contains each entry and its mirror image.
  Entries entries[2];
  std::vector<Band> bands;
  std::vector<EmptyList> empties;  ///< one a level
  MeasuredColumns columns;

  std::int64_t bytes() const;

 private:
  void add_scalars(const Draft& draft, const TransportTensor& shape);
};

}  // namespace symrig::tensor
