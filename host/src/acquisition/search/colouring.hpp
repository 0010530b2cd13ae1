// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/conflict_graph.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace symrig::acquisition {

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
