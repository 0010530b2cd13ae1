// SPDX-License-Identifier: Apache-2.0
// A dealt tensor against the whole one. mpirun runs these with one to four ranks.

#include "assert_ok.hpp"
#include "dealt_transport.hpp"
#include "scratch.hpp"
#include "symrig/base/statistics.hpp"
#include "unit/tensor/random_tensor.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::dealt_test {

namespace {

using mpi::DealtTransport;
using mpi::Ranks;

constexpr double kEpsilon = 0x1p-24;

Image<float> random_picture(Grid grid, int channels, std::uint64_t seed) {
  Random random(seed);
  Image<float> picture(grid, channels);
  for (float& v : picture.values()) v = static_cast<float>(random.uniform());
  return picture;
}

/// All values positive, so that T p is the Σ|A||B|ᵀ|p| that the bound needs.
struct Case {
  Grid camera, projector;
  bool symmetric;
  int channels;
  TransportTensor tensor;
  double roundings;  ///< (|J| + leaves on a pixel's path + ranks + 4), each of ε
};

Case make_case(Grid camera, Grid projector, bool symmetric, int channels) {
  auto made = tests::RandomTensor(camera, projector, symmetric, channels, 11, 0.0)
                  .with_band(symmetric)
                  .make(2, 3, 40);
  const double leaves = static_cast<double>(made.tensor.leaves().size()) * 3 + 40 + 4;
  const double longest = static_cast<double>(std::max(camera.size(), projector.size()));
  return {camera, projector, symmetric, channels, made.tensor, longest + leaves + Ranks::world().count() + 4};
}

/// Both sides round, each within the bound.
void expect_close(const Image<float>& dealt, const Image<float>& whole, double roundings) {
  ASSERT_EQ(dealt.grid(), whole.grid());
  ASSERT_EQ(dealt.channels(), whole.channels());
  for (std::size_t i = 0; i < whole.values().size(); ++i)
    ASSERT_LE(std::abs(static_cast<double>(dealt.values()[i]) - whole.values()[i]),
              2 * roundings * kEpsilon * whole.values()[i])
        << i;
}

class Dealt : public testing::TestWithParam<int> {
 protected:
  Dealt()
      : one_(GetParam() == 0   ? make_case({13, 10}, {13, 10}, true, 1)
             : GetParam() == 1 ? make_case({9, 12}, {9, 12}, true, 3)
                               : make_case({7, 15}, {10, 6}, false, 2)) {}

  Result<std::shared_ptr<const DealtTransport>> open() const {
    const auto path = scratch_ / "scene.h5";
    StoredScene scene;
    scene.tensor = one_.tensor;
    SYMRIG_CHECK(save_scene(path, scene));
    return DealtTransport::open(Ranks::world(), path);
  }

  test::Scratch scratch_;
  Case one_;
};

INSTANTIATE_TEST_SUITE_P(Tensors, Dealt, testing::Values(0, 1, 2));

TEST_P(Dealt, photographs_differ_by_the_stated_rounding) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  const Image<float> light = random_picture(one_.projector, 1, 1);
  const auto seen = (*dealt)->apply(light), whole = one_.tensor.apply(light);
  ASSERT_OK(seen);
  expect_close(*seen, *whole, one_.roundings);
}

TEST_P(Dealt, batches_of_any_size_do_too) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  for (const std::size_t count : {std::size_t{0}, std::size_t{2}, std::size_t{16}, std::size_t{19}}) {
    std::vector<Image<float>> lights;
    for (std::size_t k = 0; k < count; ++k) lights.push_back(random_picture(one_.projector, 1, k));
    const auto seen = (*dealt)->apply_batch(lights);
    ASSERT_OK(seen);
    ASSERT_EQ(seen->size(), count);
    for (std::size_t k = 0; k < count; ++k)
      expect_close((*seen)[k], *one_.tensor.apply(lights[k]), one_.roundings);
  }
}

TEST_P(Dealt, the_adjoint_does_too) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  const Image<float> picture = random_picture(one_.camera, one_.channels, 2);
  const auto back = (*dealt)->adjoint(picture), whole = one_.tensor.adjoint(picture);
  ASSERT_OK(back);
  expect_close(*back, *whole, one_.roundings * one_.channels);
}

TEST_P(Dealt, shares_leave_nothing_out_and_hold_nothing_twice) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  const auto mine = static_cast<double>((*dealt)->scene().tensor.leaves().size());
  if (Ranks::world().count() == 1) {
    EXPECT_EQ(mine, static_cast<double>(one_.tensor.leaves().size()));
  } else {
    EXPECT_LT(mine, static_cast<double>(one_.tensor.leaves().size()));
  }
}

TEST_P(Dealt, a_wrong_picture_is_refused_and_the_ranks_go_on) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  const auto light = (*dealt)->apply(Image<float>(Grid{3, 3}));
  ASSERT_FALSE(light);
  EXPECT_EQ(light.error().code, ErrorCode::size_mismatch);
  const auto picture = (*dealt)->adjoint(Image<float>(one_.camera, one_.channels + 1));
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().code, ErrorCode::size_mismatch);
  EXPECT_TRUE((*dealt)->apply(Image<float>(one_.projector)));
}

TEST(DealtFile, a_missing_scene_is_refused_and_the_ranks_go_on) {
  const test::Scratch scratch;
  for (int round = 0; round < 2; ++round) {
    const auto dealt = DealtTransport::open(Ranks::world(), scratch / "none.h5");
    ASSERT_FALSE(dealt);
    EXPECT_EQ(dealt.error().code, ErrorCode::not_found);
  }
}

}  // namespace

}  // namespace symrig::dealt_test

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
