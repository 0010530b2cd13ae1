// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/merging.hpp"

#include "acquisition/tree/rank_test.hpp"

#include <algorithm>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <tbb/parallel_for.h>

namespace symrig::acquisition {

NeighbouringLeaves::NeighbouringLeaves(const SearchFacts& facts, const KnownTransport& known,
                                       const Parents& parents, std::span<const LeafPiece> pieces)
    : parents_(parents),
      flood_squared_(facts.flood_squared),
      channels_(facts.channels),
      most_(facts.options.economy.rank),
      sigmas_(facts.rule().noise_sigmas),
      pieces_(pieces.begin(), pieces.end()),
      bases_(static_cast<std::size_t>(channels_) * 2 * BlockTree::kMaxChildren) {
  for (int channel = 0; channel < channels_; ++channel) {
    for (int k = 0; k < parents.row.children; ++k) make_basis(known, channel, kRow, k);
    for (int k = 0; k < parents.col.children; ++k) make_basis(known, channel, kCol, k);
  }
}

const Block& NeighbouringLeaves::child(Side side, int k) const {
  const Block& parent = side == kRow ? parents_.row : parents_.col;
  return parents_.children[static_cast<std::size_t>(parent.first_child) + static_cast<std::size_t>(k)];
}

/// The factors of all pieces on one child, side by side.
NeighbouringLeaves::Matrix NeighbouringLeaves::gather(const KnownTransport& known, int channel, Side side,
                                                      int k) {
  std::vector<LeafPiece*> there;
  int columns = 0;
  for (LeafPiece& piece : pieces_) {
    if ((side == kRow ? piece.row_child : piece.col_child) != k) continue;
    (side == kRow ? piece.row_column : piece.col_column) = columns;
    columns += piece.rank;
    there.push_back(&piece);
  }
  const std::int32_t pixels = child(side, k).size();
  Matrix factors(pixels, columns);
  Eigen::Index column = 0;
  for (const LeafPiece* piece : there) {
    const std::int64_t offset =
        channel * (std::int64_t{piece->rows()} + piece->cols()) + (side == kRow ? 0 : piece->rows());
    const auto leaves = known.leaves().subspan(piece->first, piece->rank);
    for (const KnownLeaf& leaf : leaves) {
      const float* const from = known.factors().data() + leaf.factors + offset;
      for (std::int32_t t = 0; t < pixels; ++t) factors(t, column) = static_cast<double>(from[t]);
      ++column;
    }
  }
  return factors;
}

void NeighbouringLeaves::make_basis(const KnownTransport& known, int channel, Side side, int k) {
  Matrix factors = gather(known, channel, side, k);
  Basis& basis = bases_[base(channel, side, k)];
  if (factors.cols() >= factors.rows()) {
    basis.q = Matrix::Identity(factors.rows(), factors.rows());
    basis.coordinates = std::move(factors);
  } else {
    const Eigen::HouseholderQR<Matrix> qr(factors);
    basis.q = qr.householderQ() * Matrix::Identity(factors.rows(), factors.cols());
    basis.coordinates = qr.matrixQR().topRows(factors.cols()).triangularView<Eigen::Upper>();
  }
  basis.sum = basis.q.colwise().sum().transpose();
}

/// Where the coordinates of each child begin in those of a rectangle; the last: how many there are.
std::vector<Eigen::Index> NeighbouringLeaves::begins(int channel, Side side, int first, int last) const {
  std::vector<Eigen::Index> begins{0};
  for (int k = first; k < last; ++k) begins.push_back(begins.back() + basis(channel, side, k).q.cols());
  return begins;
}

/// Q' 1 of each child, one column each.
NeighbouringLeaves::Matrix NeighbouringLeaves::sums(int channel, Side side, int first, int last) const {
  const std::vector<Eigen::Index> at = begins(channel, side, first, last);
  Matrix sums = Matrix::Zero(at.back(), last - first);
  for (int k = first; k < last; ++k) {
    const Eigen::VectorXd& sum = basis(channel, side, k).sum;
    sums.col(k - first).segment(at[k - first], sum.size()) = sum;
  }
  return sums;
}

NeighbouringLeaves::Core NeighbouringLeaves::core(const Rectangle& r, int channel) const {
  const std::vector<Eigen::Index> row_at = begins(channel, kRow, r.row_first, r.row_last);
  const std::vector<Eigen::Index> col_at = begins(channel, kCol, r.col_first, r.col_last);
  Core core{Matrix::Zero(row_at.back(), col_at.back()),
            sums(channel, kRow, r.row_first, r.row_last),
            sums(channel, kCol, r.col_first, r.col_last),
            {},
            row_at.back() <= col_at.back()};
  for (const LeafPiece& piece : pieces_) {
    if (!r.holds(piece)) continue;
    const Matrix& a = basis(channel, kRow, piece.row_child).coordinates;
    const Matrix& b = basis(channel, kCol, piece.col_child).coordinates;
    core.k
        .block(row_at[piece.row_child - r.row_first], col_at[piece.col_child - r.col_first], a.rows(),
               b.rows())
        .noalias() =
        a.middleCols(piece.row_column, piece.rank) * b.middleCols(piece.col_column, piece.rank).transpose();
  }
  return core;
}

void NeighbouringLeaves::Core::decompose(int most) {
  const Matrix gram = on_rows ? Matrix(k * k.transpose()) : Matrix(k.transpose() * k);
  const Eigen::SelfAdjointEigenSolver<Matrix> solved(gram);
  lead = solved.eigenvectors().rightCols(std::min<Eigen::Index>(most, gram.cols())).rowwise().reverse();
}

/// What is missing from the best approximation of a rank: K − W W' K.
NeighbouringLeaves::Matrix NeighbouringLeaves::Core::lost(int rank) const {
  const auto w = lead.leftCols(std::min<Eigen::Index>(rank, lead.cols()));
  return on_rows ? Matrix(k - w * (w.transpose() * k)) : Matrix(k - (k * w) * w.transpose());
}

/// The noise that a merge takes out of the images of its pieces. They see as many lit children as the
/// rectangle has on the other side. Of these, rank k keeps k directions.
double NeighbouringLeaves::lost_noise(const LeafPiece& piece, const Rectangle& r, double samples) const {
  const auto lost = [&](int children) {
    return std::max(0.0, 1 - piece.rank / static_cast<double>(children));
  };
  const double share = 0.5 * (lost(r.row_last - r.row_first) + lost(r.col_last - r.col_first));
  return noise_allowance(share * piece.noise, samples, sigmas_);
}

/// The two bounds of merge_leaves for a rank.
bool NeighbouringLeaves::good(std::span<const Core> cores, const LeafPiece& piece, const Rectangle& r,
                              double allowed) const {
  double images = 0;
  double all = 0;
  for (int channel = 0; channel < channels_; ++channel) {
    const Core& core = cores[channel];
    const double f = flood_squared_[channel];
    if (f <= 0) continue;
    const Matrix lost = core.lost(piece.rank);
    images += ((lost * core.cols).squaredNorm() + (lost.transpose() * core.rows).squaredNorm()) / f;
    all += lost.squaredNorm() / f;
  }
  const double samples = static_cast<double>(channels_) * ((r.col_last - r.col_first) * piece.rows() +
                                                           (r.row_last - r.row_first) * piece.cols());
  const double mean = allowed + lost_noise(piece, r, samples) / samples;
  return images <= samples * mean && all <= channels_ * 0.5 * (piece.rows() + piece.cols()) * mean;
}

/// What a leaf takes in a finished tensor: its range, and for each rank two columns of halves, their places
/// and their weights.
std::int64_t NeighbouringLeaves::bytes(const LeafPiece& piece) const {
  const std::int64_t a_rank =
      2 * sizeof(std::uint32_t) +
      channels_ * (std::int64_t{sizeof(float)} + 2 * (std::int64_t{piece.rows()} + piece.cols()));
  return std::int64_t{sizeof(Leaf)} + piece.rank * a_rank;
}

void NeighbouringLeaves::append_pixels(const Rectangle& r, int channel, Side side, const Eigen::VectorXd& x,
                                       std::vector<float>& out) const {
  Eigen::Index at = 0;
  const int last = side == kRow ? r.row_last : r.col_last;
  for (int k = side == kRow ? r.row_first : r.col_first; k < last; ++k) {
    const Matrix& q = basis(channel, side, k).q;
    const Eigen::VectorXd pixels = q.lazyProduct(x.segment(at, q.cols()));
    at += q.cols();
    for (const double v : pixels) out.push_back(static_cast<float>(v));
  }
}

/// The leaf of rank 1 that would replace what a rectangle holds, without factors.
Merged NeighbouringLeaves::outline(const Rectangle& r) const {
  Merged merged;
  merged.piece = {child(kRow, r.row_first).begin, child(kRow, r.row_last - 1).end,
                  child(kCol, r.col_first).begin, child(kCol, r.col_last - 1).end};
  for (const LeafPiece& p : pieces_) {
    if (!r.holds(p)) continue;
    merged.piece.noise += p.noise;
    for (int rank = 0; rank < p.rank; ++rank) merged.replaces.push_back(p.first + rank);
  }
  return merged;
}

/// T ≈ Σ w (w'T), w the leading singular vectors of the smaller side.
void NeighbouringLeaves::append_rank(const Rectangle& r, std::span<const Core> cores, int rank,
                                     std::vector<float>& out) const {
  for (int channel = 0; channel < channels_; ++channel) {
    const Core& core = cores[channel];
    Eigen::VectorXd w = Eigen::VectorXd::Zero(core.lead.rows());
    if (rank < core.lead.cols()) w = core.lead.col(rank);
    Eigen::VectorXd other(core.on_rows ? core.k.cols() : core.k.rows());
    if (core.on_rows)
      other = core.k.transpose().lazyProduct(w);
    else
      other = core.k.lazyProduct(w);
    append_pixels(r, channel, kRow, core.on_rows ? w : other, out);
    append_pixels(r, channel, kCol, core.on_rows ? other : w, out);
  }
}

// T on the rectangle is Σ_pieces a b' of blocks that touch. The best leaf of rank k is its k largest
// singular values (Eckart and Young), but its pixels are many. So:
// 1. Once for a pair of parents (make_basis): the factors of all pieces on one child are A = Q R. Then
//    T_ab = Q_a K_ab Q_b' with K_ab = R_a R_b', a few rows and columns. Q keeps lengths: |T_ab| = |K_ab|.
// 2. `core`: the K of a rectangle, put together from its children. Q' 1 of each child stands beside it,
//    because the light of a child block is T 1 = Q K Q' 1.
// 3. `decompose`: the leading eigenvectors of K K' or K' K, the smaller one. Cutting to rank k loses
//    K − W W' K.
// 4. The least k for which what is lost keeps the two bounds of merge_leaves (good), and which takes
//    fewer bytes than the pieces. If there is none, the pieces stay.
// 5. The factors, back in pixels: Q W and Q K' W (append_rank). W is orthonormal, so no weights are
//    needed.
std::optional<Merged> NeighbouringLeaves::merge(const Rectangle& r, double allowed) {
  std::int64_t before = 0;
  for (const LeafPiece& p : pieces_)
    if (r.holds(p)) before += bytes(p);
  Merged merged = outline(r);
  LeafPiece& piece = merged.piece;
  if (bytes(piece) >= before) return {};
  std::vector<Core> cores;
  for (int channel = 0; channel < channels_; ++channel) {
    cores.push_back(core(r, channel));
    cores.back().decompose(most_);
  }
  while (piece.rank <= most_ && bytes(piece) < before && !good(cores, piece, r, allowed)) ++piece.rank;
  if (piece.rank > most_ || bytes(piece) >= before) return {};
  for (int rank = 0; rank < piece.rank; ++rank) append_rank(r, cores, rank, merged.factors);
  piece.noise = 0;
  std::erase_if(pieces_, [&](const LeafPiece& p) { return r.holds(p); });
  return merged;
}

namespace {

/// θ: what a merge may add to the misfit of its pieces, as a share of τ_A. √(1 + θ²) = 1.02.
constexpr double kShare = 0.2;

/// Of a number of a factor, for Work: the Gram matrices of three ranks, and the light of the result.
constexpr std::int64_t kOperations = 32;

/// Rectangles of the 4 × 4 child pairs, the largest first: all, halves, quarters and so on, no single pair.
std::vector<Rectangle> rectangles() {
  std::vector<Rectangle> all;
  for (const int rows : {4, 2, 1})
    for (const int cols : {4, 2, 1})
      for (int a = 0; a < 4; a += rows)
        for (int b = 0; b < 4; b += cols) all.push_back({a, a + rows, b, b + cols});
  std::erase_if(all, [](const Rectangle& r) { return r.pairs() < 2; });
  std::stable_sort(all.begin(), all.end(),
                   [](const Rectangle& x, const Rectangle& y) { return x.pairs() > y.pairs(); });
  return all;
}

/// The leaves among the child pairs of one pair of blocks.
struct Family {
  const Block* row;
  const Block* col;
  std::vector<LeafPiece> pieces;
  std::vector<Merged> merged;  ///< what some of them became

  bool diagonal() const { return row == col; }
  bool fills(const LeafPiece& piece) const {
    return piece.row_begin == row->begin && piece.row_end == row->end && piece.col_begin == col->begin &&
           piece.col_end == col->end;
  }
};

/// All leaves but those of a block with itself, by level.
std::vector<std::vector<LeafPiece>> pieces(const SearchFacts& facts, const KnownTransport& known) {
  std::vector<std::vector<LeafPiece>> at_level(facts.tree.levels());
  const auto leaves = known.leaves();
  for (std::int32_t n = 0; n < std::ssize(leaves); ++n) {
    const KnownLeaf& leaf = leaves[n];
    if (leaf.removed || leaf.diagonal()) continue;
    const double noise =
        static_cast<double>(leaf.row_noise) * leaf.rows() + static_cast<double>(leaf.col_noise) * leaf.cols();
    at_level[leaf.level].push_back({leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, n, 1, noise});
  }
  return at_level;
}

/// Leaves grouped by their parents' pair, in tree order.
std::vector<Family> families(std::span<const LeafPiece> pieces, const BlockTree& tree, int level) {
  struct Member {
    std::int32_t row, col;
    LeafPiece piece;
  };
  std::vector<Member> members;
  const auto parents = tree.level(level - 1);
  for (LeafPiece piece : pieces) {
    const std::int32_t row = tree.block_at(level - 1, piece.row_begin);
    const std::int32_t col = tree.block_at(level - 1, piece.col_begin);
    piece.row_child = tree.block_at(level, piece.row_begin) - parents[row].first_child;
    piece.col_child = tree.block_at(level, piece.col_begin) - parents[col].first_child;
    members.push_back({row, col, piece});
  }
  std::stable_sort(members.begin(), members.end(), [](const Member& x, const Member& y) {
    return std::tie(x.row, x.col) < std::tie(y.row, y.col);
  });
  std::vector<Family> grouped;
  for (const Member& member : members) {
    const Block* row = &parents[member.row];
    const Block* col = &parents[member.col];
    if (grouped.empty() || grouped.back().row != row || grouped.back().col != col)
      grouped.push_back({row, col, {}, {}});
    grouped.back().pieces.push_back(member.piece);
  }
  return grouped;
}

/// Merges the largest rectangles that can be.
void merge(Family& family, const SearchFacts& facts, const KnownTransport& known,
           std::span<const Block> children) {
  static const std::vector<Rectangle> all = rectangles();
  if (family.pieces.size() < 2) return;
  const Work& work = facts.options.work;
  NeighbouringLeaves neighbours(facts, known, {*family.row, *family.col, children}, family.pieces);
  for (const Rectangle& rectangle : all) {
    const Rectangle r = rectangle.within(family.row->children, family.col->children);
    // Below a block with itself only what lies off the diagonal is a rectangle.
    if (r.pairs() < 1 || (family.diagonal() && r.row_first < r.col_last)) continue;
    if (auto merged = neighbours.merge(r, kShare * kShare * facts.tolerance()))
      family.merged.push_back(std::move(*merged));
    work.add(kOperations * facts.channels * (family.row->size() + family.col->size()));
  }
}

/// A leaf of rank k is k leaves of rank 1 on one range.
LeafPiece store(KnownTransport& known, const Merged& merged, int level) {
  for (const std::int32_t leaf : merged.replaces) known.remove_leaf(leaf);
  LeafPiece piece = merged.piece;
  const std::size_t size = merged.factors.size() / static_cast<std::size_t>(piece.rank);
  for (int k = 0; k < piece.rank; ++k) {
    const auto factors = std::span(merged.factors).subspan(static_cast<std::size_t>(k) * size, size);
    const std::int32_t leaf =
        known.add_leaf(piece.row_begin, piece.row_end, piece.col_begin, piece.col_end, level, factors);
    if (k == 0)
      piece.first = leaf;
    else
      known.join(leaf);
  }
  return piece;
}

}  // namespace

void merge_leaves(const SearchFacts& facts, KnownTransport& known) {
  if (facts.options.economy.rank < 2) return;
  std::vector<std::vector<LeafPiece>> at_level = pieces(facts, known);
  for (int level = facts.tree.levels() - 1; level > 0; --level) {
    auto grouped = families(at_level[level], facts.tree, level);
    tbb::parallel_for(std::size_t{0}, grouped.size(),
                      [&](std::size_t k) { merge(grouped[k], facts, known, facts.tree.level(level)); });
    for (const Family& family : grouped) {
      for (const Merged& merged : family.merged) {
        const bool whole = family.fills(merged.piece);
        const LeafPiece piece = store(known, merged, whole ? level - 1 : level);
        if (whole) at_level[static_cast<std::size_t>(level) - 1].push_back(piece);
      }
    }
  }
}

}  // namespace symrig::acquisition
