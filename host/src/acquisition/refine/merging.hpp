// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/search_facts.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace symrig::acquisition {

/// A leaf of any rank: `rank` leaves of rank 1 from number `first` on.
struct LeafPiece {
  std::int32_t row_begin = 0, row_end = 0;
  std::int32_t col_begin = 0, col_end = 0;
  std::int32_t first = 0;
  int rank = 1;
  double noise = 0;  ///< V: variance of its images c and r, summed, units of F²; 0 once merged
  int row_child = 0, col_child = 0;  ///< which children of the parents its blocks are
  int row_column = 0,
      col_column = 0;  ///< where its factors begin among those of all pieces on these children

  std::int32_t rows() const { return row_end - row_begin; }
  std::int32_t cols() const { return col_end - col_begin; }
};

/// Child pairs (a, b), row_first ≤ a < row_last, col_first ≤ b < col_last.
struct Rectangle {
  int row_first = 0, row_last = 0;
  int col_first = 0, col_last = 0;

  int pairs() const { return std::max(0, row_last - row_first) * std::max(0, col_last - col_first); }
  bool holds(const LeafPiece& piece) const {
    return piece.row_child >= row_first && piece.row_child < row_last && piece.col_child >= col_first &&
           piece.col_child < col_last;
  }
  Rectangle within(int rows, int cols) const {
    return {row_first, std::min(row_last, rows), col_first, std::min(col_last, cols)};
  }
};

/// One leaf for several.
struct Merged {
  LeafPiece piece;                     ///< without a number
  std::vector<std::int32_t> replaces;  ///< leaves of rank 1
  std::vector<float> factors;          ///< rank after rank as KnownTransport::add_leaf takes them
};

/// The leaves among the child pairs of one pair of blocks, in orthonormal bases of each child. So a rectangle
/// of them is a small matrix: T_ab = Q_a K_ab Q_b', |T_ab| = |K_ab|.
class NeighbouringLeaves {
 public:
  struct Parents {
    const Block& row;
    const Block& col;
    std::span<const Block> children;  ///< all blocks of their level
  };
  NeighbouringLeaves(const SearchFacts& facts, const KnownTransport& known, const Parents& parents,
                     std::span<const LeafPiece> pieces);

  /// One leaf for those of a rectangle; it replaces its pieces. Its rank is the lowest that stays within the
  /// mean square `allowed`, in units of F² (see merge_leaves). None if it would save no bytes.
  std::optional<Merged> merge(const Rectangle& rectangle, double allowed);

 private:
  using Matrix = Eigen::MatrixXd;
  /// Of one child on one side and one channel.
  struct Basis {
    Matrix q;             ///< [pixels × dimension], orthonormal columns
    Matrix coordinates;   ///< of the factors of the pieces there, one after the other
    Eigen::VectorXd sum;  ///< Q' 1
  };
  enum Side : std::uint8_t { kRow, kCol };
  /// A rectangle in the bases of its children, one channel.
  struct Core {
    Matrix k;           ///< [row dimensions × column dimensions]
    Matrix rows, cols;  ///< Q' 1_a, Q' 1_b, one column a child
    Matrix lead;        ///< its leading singular vectors on the smaller side, the largest first
    bool on_rows = true;

    void decompose(int most);
    Matrix lost(int rank) const;
  };

  const Block& child(Side side, int k) const;
  static std::size_t base(int channel, Side side, int k) {
    const auto of = static_cast<std::size_t>(channel) * 2 + side;
    return of * BlockTree::kMaxChildren + static_cast<std::size_t>(k);
  }
  const Basis& basis(int channel, Side side, int k) const { return bases_[base(channel, side, k)]; }
  Matrix gather(const KnownTransport& known, int channel, Side side, int k);
  void make_basis(const KnownTransport& known, int channel, Side side, int k);
  std::vector<Eigen::Index> begins(int channel, Side side, int first, int last) const;
  Matrix sums(int channel, Side side, int first, int last) const;
  Core core(const Rectangle& r, int channel) const;
  /// Q_1 x_1 above Q_2 x_2 and so on: a column of coordinates as pixels.
  void append_pixels(const Rectangle& r, int channel, Side side, const Eigen::VectorXd& x,
                     std::vector<float>& out) const;
  double lost_noise(const LeafPiece& piece, const Rectangle& r, double samples) const;
  bool good(std::span<const Core> cores, const LeafPiece& piece, const Rectangle& r, double allowed) const;
  std::int64_t bytes(const LeafPiece& piece) const;
  Merged outline(const Rectangle& r) const;
  void append_rank(const Rectangle& r, std::span<const Core> cores, int rank, std::vector<float>& out) const;

  Parents parents_;
  std::span<const double> flood_squared_;
  int channels_;
  int most_;  ///< rank
  double sigmas_;
  std::vector<LeafPiece> pieces_;
  std::vector<Basis> bases_;
};

// What the search had to cut in pieces to measure it, put together again.

/// Leaves of neighbouring blocks become one leaf of rank k ≤ Economy::rank where that takes fewer bytes. The
/// merge goes from the finest level up, so that a merged leaf can be merged again. T on a rectangle of child
/// pairs of one pair of blocks is cut to its k largest singular values. k is the smallest that loses no more
/// than
///   E = Σ_ab |ΔT_ab 1_b|² + |ΔT_ab' 1_a|² ≤ n ε²   in the photographs of the children, n samples,
///   L = |ΔT|²                           ≤ N ε²   in that of a random pattern of ±1, N: mean of rows and
/// columns,   ε² = (θ τ_A)² + V / n.
/// The first is the rank-1 test's own measure [Garg06 §5.2], the second sees what cancels within a child. V:
/// the noise that cutting to rank k takes out of the images of the pieces, so that no rank is spent on it.
/// The channels share k, since they share a leaf's index, and sum their E and L. Leaves of a block with
/// itself and scalars stay. Bit-equal for any number of threads.
void merge_leaves(const SearchFacts& facts, KnownTransport& known);

}  // namespace symrig::acquisition
