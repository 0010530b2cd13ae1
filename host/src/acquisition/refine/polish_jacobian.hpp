// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/known_transport.hpp"
#include "symrig/tensor/internal/kernels.hpp"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Samples of sixteen photographs and what each photograph weighs.
struct PhotographTerm {
  const float* samples;                      ///< [pixel][kBatch]
  std::array<float, tensor::kBatch> weight;  ///< [kBatch]
};

/// to[i] += Σ_terms Σ_c samples[i][c] weight[c] over n pixels: batches of photographs collapse into one
/// image. error: ≤ (terms × kBatch + 1) ε Σ|samples weight|; the same bits for any number of threads, not for
/// any instruction set.
void collapse(std::span<const PhotographTerm> terms, float* to, std::size_t n);

/// One for each factor of the known transport, in their order, then one for each scalar value.
using PolishNumbers = PagedVector<float>;

/// Where the numbers of one leaf and channel are, and its pixels.
struct LeafNumbers {
  std::size_t a, b, rows, cols, row_begin, col_begin;
};
LeafNumbers numbers_of(const KnownLeaf& leaf, std::size_t channel);

/// A leaf of a block with itself has a = b and stays as it is.
inline bool polished(const KnownLeaf& leaf) {
  return !leaf.removed && !leaf.diagonal();
}

/// Up to sixteen photographs, interleaved so that a factor that is read serves all of them. Where there are
/// fewer, the others are dark and weigh nothing. variance of the photographs given is their weight.
struct PolishBatch {
  PagedVector<float> pattern;  ///< [pixel][kBatch]
  PagedVector<float> weight;   ///< [channel][pixel][kBatch]; 0 where nothing was seen
  tensor::LitRanges lit;       ///< in any of the patterns

  explicit PolishBatch(std::span<const TreePhotograph> photographs);
  std::size_t pixels() const { return pattern.size() / tensor::kBatch; }
};

/// Samples of a batch, interleaved as its weights.
using PolishSamples = PagedVector<float>;
/// samples *= W, batch by batch.
void weigh(std::span<const PolishBatch> batches, std::span<PolishSamples> samples);
/// Their means.
PolishSamples means_of(std::span<const TreePhotograph> photographs);

/// J, the derivative of photographs by the numbers, as far as conjugate gradients need it. Both ways are
/// bit-equal for any number of threads; error: rounding as TransportTensor::apply.
class PolishJacobian {
 public:
  PolishJacobian(const KnownTransport& known, int channels, Work work = {});
  /// What image(), gather() and add_diagonal() count for a batch and a number of T.
  static constexpr std::int64_t kImageOperations = 4 * tensor::kBatch, kGatherOperations = 4 * tensor::kBatch,
                                kDiagonalOperations = 3 * tensor::kBatch;

  /// A direction, laid out for image(): a δa δb b of each leaf and channel, as A B' = a δb' + δa b', then the
  /// scalars.
  using Tangents = PagedVector<float>;
  Tangents tangents(const PolishNumbers& direction) const;
  /// W J direction for each batch.
  std::vector<PolishSamples> image(std::span<const PolishBatch> batches, const Tangents& direction) const;
  /// images = J direction for each batch. Whoever asks again hands over the same images: to fill their memory
  /// costs less than to get it.
  void respond(std::span<const PolishBatch> batches, const Tangents& direction,
               std::vector<PolishSamples>& images) const;
  /// gradient += Jᵀ samples.
  void gather(std::span<const PolishBatch> batches, std::span<const PolishSamples> samples,
              PolishNumbers& gradient) const;
  /// diagonal += diag(Jᵀ W J), with the pixels of a pattern as if drawn at random for the part of a leaf
  /// whose factor sums cancel.
  void add_diagonal(std::span<const PolishBatch> batches, PolishNumbers& diagonal) const;

 private:
  void image_of(const PolishBatch& batch, std::size_t channel, const Tangents& direction, float* y) const;
  template <class UseLeaf, class UseScalar>
  void for_each_number(std::int64_t operations, const UseLeaf& use_leaf, const UseScalar& use_scalar) const;

  const KnownTransport& known_;
  std::size_t channels_;
  Work work_;
};

/// Bounds on what any pattern of values from 0 to 1 gives in any sample, and on every sum of leaves on the
/// way: max_i Σ_leaf |a_i| Σ|b|, in doubles.
/// Of T p.
double most_light(const KnownTransport& known, int channels, std::size_t pixels);
/// Of J direction.
double most_change(const KnownTransport& known, int channels, std::size_t pixels,
                   const PolishNumbers& direction);

}  // namespace symrig::acquisition
