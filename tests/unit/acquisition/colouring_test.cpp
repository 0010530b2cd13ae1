// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/colouring.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
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

namespace symrig::acquisition::colouring_test {
namespace {

using Edge = std::pair<std::int32_t, std::int32_t>;
using Classes = std::vector<std::set<std::int32_t>>;

Edge edge(std::int32_t a, std::int32_t b) {
  return {std::max(a, b), std::min(a, b)};
}

Edge random_edge(Random& random, std::int32_t blocks) {
  const auto n = static_cast<std::uint64_t>(blocks);
  const auto a = static_cast<std::int32_t>(random.bits() % n);
  const auto b = static_cast<std::int32_t>(random.bits() % n);
  return edge(a, b);
}

Classes classes_of(const Colouring& colouring) {
  Classes classes;
  for (const auto& c : colouring.classes()) classes.emplace_back(c.begin(), c.end());
  return classes;
}

/// The Lemma of [Garg06 §5.2] read literally.
bool may_share_a_colour(std::int32_t a, std::int32_t b, std::int32_t blocks, const std::set<Edge>& unknown) {
  for (std::int32_t k = 0; k < blocks; ++k)
    if (unknown.contains(edge(a, k)) && unknown.contains(edge(b, k))) return false;
  return true;
}

/// How many blocks of a colour must not be lit together.
int conflicts(const Colouring& colouring, std::int32_t blocks, const std::set<Edge>& unknown) {
  int count = 0;
  for (const auto& c : colouring.classes())
    for (std::size_t i = 0; i < c.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) count += may_share_a_colour(c[i], c[j], blocks, unknown) ? 0 : 1;
  return count;
}

/// Blocks with an unknown partner that are not lit exactly once, and others that are lit.
int wrongly_lit(const Colouring& colouring, std::int32_t blocks, const std::set<Edge>& unknown) {
  std::vector<int> lit(blocks), wanted(static_cast<std::size_t>(blocks));
  for (const auto& c : colouring.classes())
    for (const std::int32_t b : c) ++lit[b];
  for (const auto& [a, b] : unknown) wanted[a] = wanted[b] = 1;
  int count = 0;
  for (std::size_t b = 0; b < lit.size(); ++b) count += lit[b] == wanted[b] ? 0 : 1;
  return count;
}

/// A random graph to which pairs are added one by one.
struct Growing {
  explicit Growing(std::uint64_t seed, bool loops = false)
      : random(seed),
        blocks(2 + static_cast<std::int32_t>(random.bits() % 22)),
        unknown(start(loops)),
        colouring(ConflictGraph(blocks, std::vector<Edge>(unknown.begin(), unknown.end()))) {}

  std::set<Edge> start(bool loops) {
    std::set<Edge> edges;
    const auto count = 1 + random.bits() % (2 * static_cast<std::uint64_t>(blocks));
    for (std::uint64_t k = 0; k < count; ++k) edges.insert(random_edge(random, blocks));
    if (!loops) return edges;
    std::set<Edge> with_loops = edges;
    for (const auto& [a, b] : edges) {
      with_loops.insert({a, a});
      with_loops.insert({b, b});
    }
    return with_loops;
  }
  /// A pair that is known so far; none if there is no more.
  Edge next() {
    for (;;)
      if (const Edge e = random_edge(random, blocks); !unknown.contains(e)) return e;
  }
  bool full() const { return std::ssize(unknown) == std::ptrdiff_t{blocks} * (blocks + 1) / 2; }

  Random random;
  std::int32_t blocks;
  std::set<Edge> unknown;
  Colouring colouring;
};

constexpr std::uint64_t kGraphs = 60;
constexpr int kAdds = 60;

TEST(Colouring, pairs_are_added_without_a_conflict_or_not_at_all) {
  int added = 0, refused = 0;
  for (std::uint64_t seed = 0; seed < kGraphs; ++seed) {
    Growing g(seed);
    const std::size_t colours = g.colouring.classes().size();
    for (int k = 0; k < kAdds && !g.full(); ++k) {
      const Edge pair = g.next();
      const Classes before = classes_of(g.colouring);
      if (g.colouring.add(pair.first, pair.second)) {
        g.unknown.insert(pair);
        ++added;
      } else {
        ASSERT_EQ(classes_of(g.colouring), before) << "seed " << seed << ", pair " << k;
        ++refused;
      }
      ASSERT_EQ(conflicts(g.colouring, g.blocks, g.unknown), 0) << "seed " << seed << ", pair " << k;
      ASSERT_EQ(wrongly_lit(g.colouring, g.blocks, g.unknown), 0) << "seed " << seed << ", pair " << k;
      ASSERT_EQ(g.colouring.classes().size(), colours) << "seed " << seed << ", pair " << k;
    }
  }
  EXPECT_GT(added, 100);  // both happened often enough to mean something
  EXPECT_GT(refused, 100);
}

TEST(Colouring, with_loops_no_block_is_lit_while_it_is_looked_at) {
  int added = 0;
  for (std::uint64_t seed = 0; seed < kGraphs; ++seed) {
    Growing g(seed, true);
    for (int k = 0; k < kAdds && !g.full(); ++k) {
      const Edge pair = g.next();
      if (g.colouring.add(pair.first, pair.second)) {
        g.unknown.insert(pair);
        ++added;
      }
      for (const auto& lit : classes_of(g.colouring))
        for (const auto& [a, b] : g.unknown)
          ASSERT_FALSE(a != b && lit.contains(a) && lit.contains(b))
              << "seed " << seed << ": " << a << ", " << b;
    }
  }
  EXPECT_GT(added, 100);
}

TEST(Colouring, a_refused_pair_leaves_no_trace_in_later_answers) {
  // Blocks 0 and 1 have loops and one colour. Neither a pair of the two nor with 2 fits: (0, 1) makes 0 and 1
  // conflict, (2, 0) makes 2 and 0 conflict. Had the refused (0, 1) stayed, the loop of 2 would still fit.
  const std::vector<Edge> loops{{0, 0}, {1, 1}};
  Colouring colouring(ConflictGraph(3, loops));
  ASSERT_EQ(colouring.classes().size(), 1U);
  EXPECT_FALSE(colouring.add(1, 0));
  EXPECT_FALSE(colouring.add(2, 0));
  EXPECT_TRUE(colouring.add(2, 2));
  EXPECT_EQ(classes_of(colouring), (Classes{{0, 1, 2}}));
}

TEST(Colouring, a_block_moves_to_another_colour_to_make_room) {
  // 0 and 1 share the partner 4, so there are two colours; 3 has the partner 5 and starts in the colour of 0.
  // With (3, 2) unknown it shares the partner 2 with 0 and has to leave.
  const std::vector<Edge> unknown{{4, 0}, {4, 1}, {2, 0}, {5, 3}};
  Colouring colouring(ConflictGraph(6, unknown));
  const auto colour = [&](std::int32_t block) {
    const Classes classes = classes_of(colouring);
    return std::find_if(classes.begin(), classes.end(), [&](const auto& c) { return c.count(block) != 0; }) -
           classes.begin();
  };
  ASSERT_EQ(colouring.classes().size(), 2U);
  ASSERT_EQ(colour(3), colour(0));
  EXPECT_TRUE(colouring.add(3, 2));
  EXPECT_EQ(colour(3), colour(1));
}

}  // namespace

}  // namespace symrig::acquisition::colouring_test
