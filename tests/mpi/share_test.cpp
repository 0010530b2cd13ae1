// SPDX-License-Identifier: Apache-2.0
#include "share.hpp"

#include "symrig/base/statistics.hpp"
#include "unit/tensor/random_tensor.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::share_test {
namespace {

using mpi::deal;
using mpi::LeafRange;

std::int64_t sum(const std::vector<std::int64_t>& costs, const LeafRange& range) {
  return std::accumulate(costs.begin() + static_cast<std::ptrdiff_t>(range.begin),
                         costs.begin() + static_cast<std::ptrdiff_t>(range.end), std::int64_t{0});
}

TEST(Deal, gives_every_leaf_to_one_rank_and_no_rank_more_than_its_share_and_a_leaf) {
  Random random(3);
  for (int round = 0; round < 200; ++round) {
    std::vector<std::int64_t> costs(static_cast<std::size_t>(random.uniform() * 60));
    for (std::int64_t& cost : costs) cost = 1 + static_cast<std::int64_t>(random.uniform() * 1000);
    const std::int64_t whole = std::accumulate(costs.begin(), costs.end(), std::int64_t{0});
    const std::int64_t largest = costs.empty() ? 0 : *std::max_element(costs.begin(), costs.end());
    const int count = 1 + static_cast<int>(random.uniform() * 7);
    const std::vector<LeafRange> ranges = deal(costs, 0, count);
    ASSERT_EQ(ranges.size(), static_cast<std::size_t>(count));
    std::size_t next = 0;
    for (const LeafRange& range : ranges) {
      EXPECT_EQ(range.begin, next);
      EXPECT_LE(range.begin, range.end);
      next = range.end;
      // Either end is at most half a leaf off.
      EXPECT_LE(sum(costs, range), whole / count + largest + 1);
    }
    EXPECT_EQ(next, costs.size());
  }
}

TEST(Deal, counts_what_the_first_rank_has_to_do_anyway) {
  const std::vector<std::int64_t> costs(10, 100);
  const std::vector<LeafRange> half = deal(costs, 1000, 2);
  EXPECT_EQ(half[0].end, 0U);
  EXPECT_EQ(half[1].end, costs.size());
  const std::vector<LeafRange> more = deal(costs, 200, 2);
  EXPECT_EQ(more[0].end, 4U);
}

TEST(Deal, without_leaves_gives_empty_runs) {
  for (const LeafRange& range : deal({}, 5, 3)) EXPECT_EQ(range.begin, range.end);
}

TEST(Share, costs_are_the_bytes_that_16_lights_move) {
  const auto made = tests::RandomTensor(Grid{8, 8}, Grid{8, 8}, false, 2, 5).make(1, 3, 0);
  const std::vector<std::int64_t> costs = mpi::costs_of(made.tensor);
  std::int64_t columns = 0;
  for (const Leaf& leaf : made.tensor.leaves())
    columns += std::int64_t{2} * leaf.rank * made.tensor.channels();
  // Two bytes for a half; four times 16 floats for a column.
  EXPECT_EQ(std::accumulate(costs.begin(), costs.end(), std::int64_t{0}),
            2 * static_cast<std::int64_t>(made.tensor.factors()->size()) + 256 * columns);
}

TEST(Share, parts_hold_each_leaf_as_it_was) {
  const auto made = tests::RandomTensor(Grid{9, 7}, Grid{9, 7}, true, 2, 8).with_band(true).make(2, 2, 30);
  const TransportTensor& whole = made.tensor;
  std::vector<float> joined;
  std::size_t leaves = 0;
  for (const LeafRange& range : deal(mpi::costs_of(whole), 0, 3)) {
    const TransportTensor part = *mpi::part_of(whole, range, leaves == 0);
    const std::vector<float> factors = *part.factors();
    joined.insert(joined.end(), factors.begin(), factors.end());
    EXPECT_EQ(part.scalar_count(), leaves == 0 ? whole.scalar_count() : 0);
    EXPECT_EQ(part.bands().size(), leaves == 0 ? 1U : 0U);
    leaves += part.leaves().size();
  }
  EXPECT_EQ(leaves, whole.leaves().size());
  EXPECT_EQ(joined, *whole.factors());
}

}  // namespace
}  // namespace symrig::share_test
