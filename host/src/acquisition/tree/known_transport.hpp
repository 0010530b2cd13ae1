// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/photographer.hpp"
#include "symrig/base/paged_vector.hpp"
#include "symrig/tensor/block_tree.hpp"
#include "symrig/tensor/internal/kernels.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// A rank-1 leaf that is still being worked on: T_IJ ≈ a b' on I = [row_begin, row_end), J = [col_begin,
/// col_end) in tree order, and T_JI its mirror.
struct KnownLeaf {
  std::int32_t row_begin = 0, row_end = 0;
  std::int32_t col_begin = 0, col_end = 0;
  std::int32_t level = 0;
  float row_noise = 0,
        col_noise = 0;       ///< mean variance of its images c and r, summed over channels, units of F²
  bool removed = false;      ///< taken back (reopened), or merged with others
  std::int64_t factors = 0;  ///< offset of a then b, channel after channel
  bool joined = false;       ///< a further rank of the leaf before it, which has the same range

  std::int32_t rows() const { return row_end - row_begin; }
  std::int32_t cols() const { return col_end - col_begin; }
  bool diagonal() const { return row_begin == col_begin; }
};

/// The factors of one channel of a leaf.
struct LeafSides {
  std::span<const float> a, b;
};

/// The transport known so far, in single precision and open to change, unlike the TransportTensor it ends as.
class KnownTransport {
 public:
  /// work: counts what subtracting takes.
  KnownTransport(const BlockTree& tree, int channels, Work work = {})
      : tree_(tree), channels_(channels), work_(std::move(work)) {}

  /// factors: for each channel a then b. Returns the leaf's number.
  std::int32_t add_leaf(std::int32_t row_begin, std::int32_t row_end, std::int32_t col_begin,
                        std::int32_t col_end, int level, std::span<const float> factors);
  void set_noise(std::int32_t leaf, float row, float col) {
    leaves_[leaf].row_noise = row;
    leaves_[leaf].col_noise = col;
  }
  void remove_leaf(std::int32_t leaf) {
    leaves_[leaf].removed = true;
    ++rewritten_;
  }
  /// Undoes remove_leaf().
  void restore_leaf(std::int32_t leaf) {
    leaves_[leaf].removed = false;
    ++rewritten_;
  }
  /// Makes the leaf a further rank of the one before it.
  void join(std::int32_t leaf) { leaves_[leaf].joined = true; }
  void add_empty(int level, std::int32_t row_block, std::int32_t col_block);
  /// noise: variance, summed over channels, units of F².
  void add_scalar(std::int32_t row, std::int32_t col, std::span<const float> values, float noise = 0);

  /// Scalars that are added from now on lie within `radius` pixels of the diagonal: the tensor stores them as
  /// a band, without an index.
  void begin_band(int radius);

  /// What has been added since mark() is forgotten by rewind().
  struct Mark {
    std::size_t leaves = 0, factors = 0, empties = 0, scalars = 0;
  };
  Mark mark() const { return {leaves_.size(), factors_.size(), empties_.size(), scalars_.size()}; }
  void rewind(const Mark& mark);
  /// Forgets everything, and frees its memory.
  void release();

  std::span<const KnownLeaf> leaves() const { return leaves_; }
  std::span<float> change_factors() {
    ++rewritten_;
    return factors_;
  }
  std::span<const float> factors() const { return factors_; }
  LeafSides sides(const KnownLeaf& leaf, int channel) const;
  std::span<const ScalarLeaf> scalars() const { return scalars_; }
  std::span<float> change_scalar_values() {
    ++rewritten_;
    return scalar_values_;
  }
  std::span<const float> scalar_values() const { return scalar_values_; }
  std::span<const float> scalar_noise() const { return scalar_noise_; }

  /// mean −= T_known · pattern, sixteen photographs to one pass over the factors: what is left is the light
  /// of unknown transport.  error: rounding as TransportTensor::apply.  Bit-equal for any number of threads.
  /// A few large photographs go without the sixteen lanes, which would be mostly empty; then the error is
  /// that of subtract_lit().  [Garg06 §5, eq. 6]
  void subtract_from(std::span<TreePhotograph> photographs) const { subtract_from(photographs, {}); }
  /// The same for what was added since `since` alone.
  void subtract_from(std::span<TreePhotograph> photographs, const Mark& since) const;

  /// The same for patterns of lit blocks, which need no image. Only leaves that a pattern lights cost time,
  /// so a few photographs take as little time each as many. The values of one do not depend on the others.
  /// means: one a pattern, [channel][pixel].  error: (n + 2) ε of |mean| + Σ|a| |b|' p, n: pixels of a leaf,
  /// and leaves and scalars of a pixel.
  void subtract_lit(std::span<const LitBlocks> patterns, std::span<const std::span<float>> means) const;

  /// How often something was removed or handed out to be changed: what was subtracted at an equal count only
  /// lacks what was added since.
  std::int64_t rewritten() const { return rewritten_; }

  /// A tensor to be finished. It holds copies.
  TensorBuilder draft() const;
  /// The finished tensor.
  TransportTensor tensor() const { return draft().finish(); }

 private:
  /// y += T_known p of a batch; p: floats or masks (tensor::add_leaf_batch).
  template <class P>
  void add_light(const P* p, const tensor::LitRanges& lit, std::size_t channel, const Mark& since,
                 float* y) const;
  /// The leaves from some one on whose factors are in memory at once.
  struct LeafRun {
    std::size_t first, last;  ///< leaves
    std::size_t begin;        ///< offset of the first one's factors
    const float* factors;
  };
  /// run(LeafRun) for all leaves from `first` on, in their order.
  template <class Run>
  void for_runs(std::size_t first, const Run& run) const;
  /// task(photograph, channel, its mean) for each channel of each photograph, in parallel.
  template <class Task>
  void for_channels(std::span<const std::span<float>> means, const Task& task) const;
  /// patterns: LitPixels, or what has its sum() and [].
  template <class Pattern>
  void subtract_each(std::span<const Pattern> patterns, std::span<const std::span<float>> means,
                     const Mark& since) const;
  void subtract_few(std::span<TreePhotograph> photographs, const Mark& since) const;
  std::size_t end_of_run(std::size_t first) const;
  void subtract_batch(std::span<TreePhotograph> batch, std::size_t channel, const Mark& since) const;

  const BlockTree& tree_;
  int channels_;
  Work work_;
  std::vector<KnownLeaf> leaves_;
  PagedVector<float> factors_;
  struct Empty {
    std::int32_t level, row_block, col_block;
  };
  std::vector<Empty> empties_;
  PagedVector<ScalarLeaf> scalars_;
  PagedVector<float> scalar_values_;  // [scalar][channel]
  PagedVector<float> scalar_noise_;
  std::int64_t rewritten_ = 0;
  int band_radius_ = 0;         // 0: no band
  std::size_t band_begin_ = 0;  // its first scalar

  void add_leaves_to(TensorBuilder& builder) const;
  void add_band_to(TensorBuilder& builder) const;
};

}  // namespace symrig::acquisition
