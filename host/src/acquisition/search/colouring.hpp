// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace symrig::acquisition {

/// The graph G of [Garg06 §5.2]: vertices are blocks, an edge (a loop too) says that the transport between
/// two blocks is unknown.
class ConflictGraph {
 public:
  /// unknown: pairs of block indices in [0, blocks); a pair of equal indices is a loop. Each unordered pair
  /// once.
  ConflictGraph(std::int32_t blocks, std::span<const std::pair<std::int32_t, std::int32_t>> unknown);

  std::int32_t blocks() const { return static_cast<std::int32_t>(first_.size()) - 1; }
  /// Blocks whose transport with `block` is unknown (itself among them if its loop is there).
  std::span<const std::int32_t> partners(std::int32_t block) const;

  /// Lemma of [Garg06 §5.2]: a and b must not be lit together iff some k has both T_ka and T_kb unknown (an
  /// edge of G²).
  bool conflict(std::int32_t a, std::int32_t b) const;

  /// Colours G² greedily, blocks with most partners within two steps first. Result: one colour class after
  /// another, each a set of blocks that may be lit together; blocks without partners are in none.
  /// Deterministic.
  std::vector<std::vector<std::int32_t>> colour() const;

 private:
  std::vector<std::int32_t> first_;     // partners of b: partners_[first_[b] .. first_[b + 1])
  std::vector<std::int32_t> partners_;  // sorted within a block
};

/// A colouring of the square of a conflict graph. It adds unknown pairs where the existing colours have room
/// for them.
class Colouring {
 public:
  explicit Colouring(const ConflictGraph& graph);

  /// Makes the pair (a, b) measurable as well, if that takes no further colour. Blocks without a colour get
  /// one, and one of the two may move to another. A block that had no partner becomes its own partner too: it
  /// is not lit while it is looked at. False: the pair does not fit, and nothing has changed.
  bool add(std::int32_t a, std::int32_t b);

  /// Blocks that each pattern lights.
  const std::vector<std::vector<std::int32_t>>& classes() const { return classes_; }

 private:
  bool free(std::int32_t block, std::size_t colour) const;
  std::optional<std::size_t> free_colour(std::int32_t block) const;
  bool settle(std::int32_t block);
  void light(std::int32_t block, std::size_t colour);
  void unlight(std::int32_t block);

  std::vector<std::vector<std::int32_t>> partners_;  // of each block, in the order they came
  std::vector<std::int32_t> colour_;                 // of each block; -1: none
  std::vector<std::int32_t> place_;                  // of each block in its class
  std::vector<std::vector<char>> lit_;               // [colour][block]
  std::vector<std::vector<std::int32_t>> classes_;
};

}  // namespace symrig::acquisition
