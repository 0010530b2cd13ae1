// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/rank_test.hpp"
#include "symrig/base/paged_vector.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// A pair of blocks (I, J) of one level, I ≥ J in block order, whose transport T_IJ (and its mirror T_JI) is
/// not known yet. Diagonal when I = J. Its estimate is c r'/s: c = T_IJ 1_J seen on I, r = T_JI 1_I seen on
/// J, s = (Σc + Σr)/2. [Garg06 §5.2]
struct Node {
  std::int32_t row = 0, col = 0;  ///< block indices in their level
  std::int64_t estimate = 0;      ///< offset of c then r (c only on the diagonal), channel after channel
  std::int64_t evidence = -1;     ///< offset of the child photographs, channel after channel; -1: not tested
  std::int64_t pairs = -1;        ///< offset of the child-pair statistics, channel after channel
  /// Misfit that a test is expected to find, times the decay (rank_test.hpp); ∞: it must be tested.
  double undecayed = std::numeric_limits<double>::infinity();
  bool split = false;  ///< a check has found its leaf wrong: whatever its own photographs say, it is no leaf
  bool distrusted =
      false;  ///< descends from such a node: block patterns were deceived here, so it must be tested

  bool diagonal() const { return row == col; }
};

/// What the samples of one child photograph in one child block are worth.
struct PairNoise {
  float variance = 0;      ///< summed over the valid samples
  std::int32_t valid = 0;  ///< how many
};

/// One channel of an estimate: sums and noise that the rank test needs.
struct EstimateSums {
  /// (Σc + Σr)/2, each Σ the sum of |Σ over a child|, and kept ≥ |c|, |r|. For transport ≥ 0 this is the
  /// plain sum. Noise and errors of other leaves have both signs, and add up to almost nothing over a block:
  /// with a plain sum, c r'/s would be too large by up to the root of the block's size.
  double s = 0;
  float c_noise = 0;  ///< Σ variance of c
  float r_noise = 0;
};

/// All unknown nodes of one level with their estimates and, once photographed, their evidence.
class NodeLevel {
 public:
  NodeLevel(const BlockTree& tree, int level, int channels)
      : blocks_(tree.level(level)), level_(level), channels_(channels) {
    if (level + 1 < tree.levels()) children_ = tree.level(level + 1);
  }

  int level() const { return level_; }
  int channels() const { return channels_; }
  std::span<const Node> nodes() const { return nodes_; }
  const Block& block(std::int32_t index) const { return blocks_[index]; }
  std::int32_t block_count() const { return static_cast<std::int32_t>(blocks_.size()); }
  /// Child k of a block.
  const Block& child(const Block& block, int k) const {
    return children_[std::int64_t{block.first_child} + k];
  }

  /// Adds a node. c, r: [channel][pixel of the block]; r is empty on the diagonal. noise: per channel.
  void add(std::int32_t row, std::int32_t col, std::span<const float> c, std::span<const float> r,
           std::span<const PairNoise> c_noise, std::span<const PairNoise> r_noise, double undecayed);

  /// The node added last is no leaf.
  void split_last() { nodes_.back().split = nodes_.back().distrusted = true; }
  void distrust_last() { nodes_.back().distrusted = true; }

  /// Bytes that make_room() for these nodes would add up to.
  std::int64_t room(std::span<const std::int32_t> tested) const;
  /// Makes room for the evidence of nodes (indices) that are going to be tested.
  void make_room(std::span<const std::int32_t> tested);

  /// Gives back the memory of the evidence.
  void drop_evidence();

  enum class Side : std::uint8_t { row, col };
  /// Keeps the part of a photograph that belongs to `node`: child `slot` of the block on side `lit` was lit,
  /// the other block is seen. residual, variance, valid: whole photograph in tree order [channel][pixel],
  /// known transport already subtracted. A sample that is not valid takes the estimate's value, so that it
  /// neither speaks for nor against it.
  void record(const Node& node, Side lit, int slot, std::span<const float> residual,
              std::span<const float> variance, std::span<const std::uint8_t> valid);
  /// Takes what record() kept of a node out of a later photograph in which the same child is lit again.
  void subtract_measured(const Node& node, Side lit, int slot, std::span<float> residual) const;

  /// Adds what the estimate foresees of a photograph in which child `slot` on side `lit` is lit: c r'/s. On
  /// the diagonal, where c is mostly direct light: all of c on the lit child, `beside` c on the others.
  void add_estimate(const Node& node, Side lit, int slot, float beside, std::span<float> light) const;

  /// Light that tested diagonal nodes saw on children that were lit, and on one that was not, on average.
  struct DiagonalLight {
    double lit = 0, beside = 0;
  };
  DiagonalLight diagonal_light(std::span<const std::int32_t> tested) const;

  /// E, S, V, n and the energy of each child, each channel divided by its F² (flood_squared).
  RankEvidence evidence(const Node& node, std::span<const double> flood_squared) const;

  std::span<const float> c(const Node& node, int channel) const;
  std::span<const float> r(const Node& node, int channel) const;  ///< = c on the diagonal
  const EstimateSums& sums(const Node& node, int channel) const;
  /// Photograph of child `slot` of the column block, seen on the row block; and the other way round (the same
  /// on the diagonal).
  std::span<const float> y(const Node& node, int slot, int channel) const;
  std::span<const float> z(const Node& node, int slot, int channel) const;
  /// Noise of y (lit child b of J) in child a of I; of z (lit child a of I) in child b of J.
  const PairNoise& y_noise(const Node& node, int b, int a, int channel) const;
  const PairNoise& z_noise(const Node& node, int a, int b, int channel) const;

 private:
  /// Sum over children of |Σ over the child|; of a block without children |Σ|.
  double light(std::span<const float> image, const Block& of) const;
  float gain(const Node& node, Side lit, int slot, int channel) const;
  std::size_t y_offset(const Node& node, int slot, int channel) const;
  std::size_t z_offset(const Node& node, int slot, int channel) const;
  std::size_t pair_offset(const Node& node, Side lit, int slot, int channel) const;
  std::int64_t evidence_size(const Node& node) const;  ///< floats a channel
  std::int64_t pair_count(const Node& node) const;     ///< PairNoise a channel
  void add_side_evidence(const Node& node, Side lit, int channel, double scale, RankEvidence& into) const;

  std::span<const Block> blocks_, children_;
  int level_;
  int channels_;
  std::vector<Node> nodes_;
  PagedVector<float> estimates_;
  PagedVector<EstimateSums> sums_;
  PagedVector<float> evidence_;
  PagedVector<PairNoise> pairs_;
};

/// The flood-lit photograph in tree order. It is the estimate of the root: c = r = T 1.
struct FloodLit {
  PagedVector<float> image;      ///< [channel][pixel]
  std::vector<PairNoise> noise;  ///< of each channel
  std::vector<double> squared;   ///< F² of each channel, the mean square of its valid pixels
  bool noisy = false;            ///< photographs have a variance

  /// Reads photograph 0 of the log.
  /// fails: bad_value (no pixel is valid); as Photographer::read.
  static Result<FloodLit> read(const Photographer& photographer, int channels);
};

}  // namespace symrig::acquisition
