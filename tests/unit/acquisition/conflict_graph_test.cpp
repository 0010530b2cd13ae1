// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/colouring.hpp"

#include <set>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace symrig::acquisition::conflict_graph_test {
namespace {

using Edge = std::pair<std::int32_t, std::int32_t>;

/// The Lemma of [Garg06 §5.2] read literally: exists k with T_ik and T_jk both not known.
bool garg06_cannot_be_scheduled_together(std::int32_t i, std::int32_t j, std::int32_t blocks,
                                         const std::set<Edge>& unknown) {
  const auto is_unknown = [&](std::int32_t a, std::int32_t b) {
    return unknown.contains({std::max(a, b), std::min(a, b)});
  };
  for (std::int32_t k = 0; k < blocks; ++k)
    if (is_unknown(i, k) && is_unknown(j, k)) return true;
  return false;
}

std::set<Edge> random_edges(std::int32_t blocks) {
  std::set<Edge> edges;
  const auto count = *rc::gen::inRange(0, 3 * blocks);
  for (int e = 0; e < count; ++e) {
    const auto a = *rc::gen::inRange(0, blocks);
    const auto b = *rc::gen::inRange(0, blocks);
    edges.insert({std::max(a, b), std::min(a, b)});
  }
  return edges;
}

RC_GTEST_PROP(ConflictGraph, no_colour_ever_holds_two_blocks_that_share_an_unknown_partner, ()) {
  const auto blocks = *rc::gen::inRange(1, 24);
  const std::set<Edge> unknown = random_edges(blocks);
  const ConflictGraph graph(blocks, std::vector<Edge>(unknown.begin(), unknown.end()));
  for (const auto& colour : graph.colour())
    for (const std::int32_t i : colour)
      for (const std::int32_t j : colour)
        if (i != j) RC_ASSERT(!garg06_cannot_be_scheduled_together(i, j, blocks, unknown));
}

RC_GTEST_PROP(ConflictGraph, every_block_with_an_unknown_partner_is_lit_exactly_once, ()) {
  const auto blocks = *rc::gen::inRange(1, 24);
  const std::set<Edge> unknown = random_edges(blocks);
  const ConflictGraph graph(blocks, std::vector<Edge>(unknown.begin(), unknown.end()));
  std::vector<int> lit(blocks);
  for (const auto& colour : graph.colour())
    for (const std::int32_t b : colour) ++lit[b];
  for (std::int32_t b = 0; b < blocks; ++b) RC_ASSERT(lit[b] == (graph.partners(b).empty() ? 0 : 1));
}

RC_GTEST_PROP(ConflictGraph, conflict_is_the_lemma, ()) {
  const auto blocks = *rc::gen::inRange(2, 16);
  const std::set<Edge> unknown = random_edges(blocks);
  const ConflictGraph graph(blocks, std::vector<Edge>(unknown.begin(), unknown.end()));
  for (std::int32_t i = 0; i < blocks; ++i)
    for (std::int32_t j = 0; j < i; ++j)
      RC_ASSERT(graph.conflict(i, j) == garg06_cannot_be_scheduled_together(i, j, blocks, unknown));
}

TEST(ConflictGraph, diagonal_unknowns_alone_share_one_colour) {
  const std::vector<Edge> loops{{0, 0}, {1, 1}, {2, 2}};
  EXPECT_EQ(ConflictGraph(3, loops).colour().size(), 1U);
}

TEST(ConflictGraph, a_chain_needs_three_colours_because_of_the_square) {
  // Loops and 0-1-2-3: blocks one and two steps apart conflict, so 0, 1, 2 differ and 3 may repeat the colour
  // of 0.
  const std::vector<Edge> chain{{0, 0}, {1, 1}, {2, 2}, {3, 3}, {1, 0}, {2, 1}, {3, 2}};
  EXPECT_EQ(ConflictGraph(4, chain).colour().size(), 3U);
}

}  // namespace
}  // namespace symrig::acquisition::conflict_graph_test
