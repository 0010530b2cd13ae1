// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/internal/half.hpp"
#include "symrig/tensor/transport_tensor.hpp"
#include "tensor/panels.hpp"

#include <cstdint>
#include <span>
#include <vector>

#include <tbb/cache_aligned_allocator.h>

namespace symrig::tensor {

/// The factors of leaves as a scene file has them (docs/file-format.md).
struct PartValues {
  std::vector<Half> halves;
  std::vector<std::int32_t> exponents;
};

/// The low-rank leaves of a tensor, packed: T = Σ_q w_q a_q b_qᵀ over *pairs* q of factor columns, a and b as
/// halves with their largest value near 2⁷, w the power of two that restores their size.
/// In a symmetric tensor a pair stands for w (a bᵀ + b aᵀ), or for w a aᵀ on the diagonal where b = ±a.
/// It is applied in three steps: dot products of all columns with p, an exchange that gives each column the
/// product of its partner, and the sum of the weighted columns. source: performance notes in
/// docs/benchmarks.md
class LowRank {
 public:
  struct Shape {
    std::int64_t camera, projector;  ///< pixels
    bool symmetric;
    int channels;
  };

  LowRank() = default;
  /// factors: leaf after leaf, in the order of TensorBuilder::add_leaf.
  /// error of an entry: ≤ Σ_q 2⁻¹⁰ |a_q||b_q| (1 + 2⁻¹²) + 2⁻³¹ max|a_q| max|b_q|.
  LowRank(std::span<const Leaf> leaves, std::span<const float> factors, const Shape& shape);

  /// Becomes the low-rank leaves of other factors, in the same memory. values: checked; they are changed.
  void assign(std::span<const Leaf> leaves, PartValues& values, const Shape& shape);

  /// The given factors, rounded. A power of two may have moved from A to B.
  std::vector<float> factors(std::span<const Leaf> leaves) const;

  /// The side of the incoming light, and the side that sees it.
  const Panels& lit(bool transposed) const { return sides_[symmetric_ || transposed ? 0 : 1]; }
  const Panels& seen(bool transposed) const { return sides_[symmetric_ || !transposed ? 0 : 1]; }
  const Half* lit_stream(int channel, bool transposed) const {
    return stream(channel, symmetric_ || transposed ? 0 : 1);
  }
  const Half* seen_stream(int channel, bool transposed) const {
    return stream(channel, symmetric_ || !transposed ? 0 : 1);
  }

  /// to[column] = w from[its partner], Width values for each column.
  template <std::size_t Width>
  void exchange(int channel, const float* from, float* to) const;

  std::int64_t bytes() const;

 private:
  using Stream = std::vector<Half, tbb::cache_aligned_allocator<Half>>;
  struct Pair;
  /// A pair of a symmetric tensor on the diagonal: not mirrored.
  struct Diagonal {
    std::uint32_t pair;
    bool shared;  ///< b = ±a: only one column is stored
  };

  static std::vector<Pair> pairs_of(std::span<const Leaf> leaves, int channels);
  const Half* stream(int channel, std::size_t side) const {
    return streams_[static_cast<std::size_t>(channel) * (symmetric_ ? 1 : 2) + side].data();
  }
  float* weights(int channel) { return weights_.data() + static_cast<std::size_t>(channel) * pairs_; }
  const float* weights(int channel) const {
    return weights_.data() + static_cast<std::size_t>(channel) * pairs_;
  }
  void round_factors(std::span<const Pair> pairs, std::span<const float> factors, std::vector<Half>& halves);
  void scale_factors(std::span<const Leaf> leaves, PartValues& values);
  void keep(std::span<const Pair> pairs, const std::vector<Half>& halves, const Shape& shape);
  void find_diagonal(std::span<const Pair> pairs, const std::vector<Half>& halves);
  void lay_out(std::span<const Pair> pairs, const Shape& shape);
  template <class Visit>
  void for_values(std::span<const Pair> pairs, int channel, const Visit& visit) const;

  bool symmetric_ = true;
  int channels_ = 0;
  std::size_t pairs_ = 0;
  Panels sides_[2];              // camera and projector; the first holds both when symmetric
  std::vector<Stream> streams_;  // [channel][side]
  std::vector<float> weights_;   // [channel][pair]
  std::vector<Diagonal> diagonal_;
};

template <std::size_t Width>
void LowRank::exchange(int channel, const float* from, float* to) const {
  const float* const w = weights(channel);
  const auto hand = [&](std::size_t into, std::size_t of, float weight) {
    for (std::size_t lane = 0; lane < Width; ++lane)
      to[into * Width + lane] = weight * from[of * Width + lane];
  };
  if (!symmetric_) {
    for (std::size_t q = 0; q < pairs_; ++q) hand(q, q, w[q]);
    return;
  }
  for (std::size_t q = 0; q < pairs_; ++q) {
    hand(2 * q, 2 * q + 1, w[q]);
    hand(2 * q + 1, 2 * q, w[q]);
  }
  for (const auto& [q, shared] : diagonal_) {
    hand(2 * q, shared ? 2 * q : 2 * q + 1, w[q]);
    hand(2 * q + 1, 2 * q, 0.0F);
  }
}

}  // namespace symrig::tensor
