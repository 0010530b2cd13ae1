// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
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

}  // namespace symrig::acquisition
