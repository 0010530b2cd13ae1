// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/merging.hpp"

#include "acquisition/refine/neighbouring_leaves.hpp"

#include <algorithm>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
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
  std::vector<Piece> pieces;
  std::vector<Merged> merged;  ///< what some of them became

  bool diagonal() const { return row == col; }
  bool fills(const Piece& piece) const {
    return piece.row_begin == row->begin && piece.row_end == row->end && piece.col_begin == col->begin &&
           piece.col_end == col->end;
  }
};

/// All leaves but those of a block with itself, by level.
std::vector<std::vector<Piece>> pieces(const SceneFacts& facts, const KnownTransport& known) {
  std::vector<std::vector<Piece>> at_level(facts.tree.levels());
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
std::vector<Family> families(std::span<const Piece> pieces, const BlockTree& tree, int level) {
  struct Member {
    std::int32_t row, col;
    Piece piece;
  };
  std::vector<Member> members;
  const auto parents = tree.level(level - 1);
  for (Piece piece : pieces) {
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
void merge(Family& family, const SceneFacts& facts, const KnownTransport& known,
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
Piece store(KnownTransport& known, const Merged& merged, int level) {
  for (const std::int32_t leaf : merged.replaces) known.remove_leaf(leaf);
  Piece piece = merged.piece;
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

void merge_leaves(const SceneFacts& facts, KnownTransport& known) {
  if (facts.options.economy.rank < 2) return;
  std::vector<std::vector<Piece>> at_level = pieces(facts, known);
  for (int level = facts.tree.levels() - 1; level > 0; --level) {
    auto grouped = families(at_level[level], facts.tree, level);
    tbb::parallel_for(std::size_t{0}, grouped.size(),
                      [&](std::size_t k) { merge(grouped[k], facts, known, facts.tree.level(level)); });
    for (const Family& family : grouped) {
      for (const Merged& merged : family.merged) {
        const bool whole = family.fills(merged.piece);
        const Piece piece = store(known, merged, whole ? level - 1 : level);
        if (whole) at_level[static_cast<std::size_t>(level) - 1].push_back(piece);
      }
    }
  }
}

}  // namespace symrig::acquisition
