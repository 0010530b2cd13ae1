// SPDX-License-Identifier: Apache-2.0
// What a capture says of its own errors, against the truth: seeds and sizes that nothing was tuned on.
#include "symrig/acquisition/error_estimate.hpp"

#include "acquisition/errors/error_estimate.hpp"
#include "dense_scene.hpp"
#include "judged_capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::error_estimate_test {
namespace {

using tests::default_options;
using tests::judge;
using tests::Judged;

TEST(ErrorEstimate, is_not_given_where_no_light_is_seen) {
  const Judged plane = judge("sim:plane?size=32x32&seed=912");
  EXPECT_TRUE(std::isnan(plane.result.estimated->indirect));
  EXPECT_TRUE(std::isnan(plane.result.estimated->bar_indirect));
  ASSERT_EQ(plane.result.estimate_not_given.size(), 2U);
  EXPECT_EQ(plane.result.estimate_not_given[0].key, "indirect");
  EXPECT_NE(plane.result.estimate_not_given[0].reason.find("noise"), std::string::npos);
}

TEST(ErrorEstimate, knows_how_far_each_level_may_be_off) {
  const Judged judged = judge("sim:vgroove-textured?size=32x32&seed=914");
  ASSERT_FALSE(judged.result.error_per_level.empty());
  ASSERT_EQ(judged.result.error_per_level.size(), judged.result.error_per_level_half_width.size());
  for (const double width : judged.result.error_per_level_half_width) EXPECT_GT(width, 0);
}

TEST(ErrorEstimate, a_target_counts_as_reached_when_the_whole_interval_is_below_it) {
  const tests::DenseTransport scene = tests::facing_planes(Grid{32, 32});
  tests::DenseProbe unbound(scene, 1e-4);
  const auto all = capture(unbound, default_options());
  ASSERT_TRUE(all.ok());
  ASSERT_GE(all->error_per_level.size(), 3U);
  // Met by the estimate of the first level alone, but not by its upper end.
  CaptureOptions options = default_options();
  options.target_error = all->error_per_level[0] + 0.5 * all->error_per_level_half_width[0];
  tests::DenseProbe probe(scene, 1e-4);
  const auto result = capture(probe, options);
  ASSERT_TRUE(result.ok());
  EXPECT_GT(result->error_per_level.size(), 1U);
}

TEST(MeasuredErrors, say_how_far_twelve_random_vectors_may_be_off) {
  const Judged judged = judge("sim:mirror?size=32x32&seed=915&noise=off");
  const auto scene = make_scene(*parse_scene_uri("sim:mirror?size=32x32&seed=915&noise=off"));
  const TrueTransport truth = [&](const Image<float>& p) -> Result<Image<float>> {
    return (*scene)->apply(p);
  };
  const TransportErrors exact = *evaluate(judged.result.tensor, truth, {400, 99});
  int inside = 0;
  constexpr int kTries = 40;
  for (unsigned seed = 1; seed <= kTries; ++seed) {
    const auto told = measure_errors(judged.result.tensor, truth, {12, seed});
    ASSERT_TRUE(told.ok());
    EXPECT_EQ(told->half_width.flood, 0) << "exact";
    EXPECT_GT(told->half_width.frobenius, 0);
    inside += std::abs(told->value.frobenius - exact.frobenius) <= told->half_width.frobenius ? 1 : 0;
  }
  // 38 expected; a jackknife of twelve skewed samples is a few per cent optimistic, a binomial count of 40
  // scatters by 1.4: three of that.
  EXPECT_GE(inside, 0.9 * kTries - 4.2);
}

namespace sums {

using acquisition::energy_interval;
using acquisition::EnergyInterval;

TEST(EnergyInterval, holds_the_mean_of_squares) {
  // χ² with d degrees of freedom, over d: mean 1, variance 2 / d.
  tests::Gaussian gaussian(7);
  for (const int d : {6, 12, 60}) {
    int inside = 0;
    constexpr int kTries = 2000;
    for (int k = 0; k < kTries; ++k) {
      double energy = 0;
      for (int j = 0; j < d; ++j) energy += std::pow(gaussian(), 2) / d;
      const EnergyInterval in = energy_interval(energy, 2.0 / d * energy * energy);
      inside += in.low <= 1 && 1 <= in.high ? 1 : 0;
    }
    EXPECT_GE(inside, 0.94 * kTries) << d;  // 0.954 less three standard deviations of the count
    EXPECT_LE(inside, 0.975 * kTries) << d;
  }
}

}  // namespace sums

TEST(OneSided, light_to_one_side_is_told_from_light_both_ways) {
  const Grid grid{24, 20};
  Random random(5);
  Image<float> z(grid);
  for (float& v : z.values()) v = random.sign();
  Image<float> both(grid), right(grid);
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.cols; ++c) {
      const float left_of = c > 0 ? z.at(r, c - 1) : 0.F;
      const float right_of = c + 1 < grid.cols ? z.at(r, c + 1) : 0.F;
      both.at(r, c) = 0.1F * (left_of + right_of);
      right.at(r, c) = 0.1F * left_of;
    }
  EXPECT_EQ(acquisition::one_sided(both, z).energy, 0);
  const auto found = acquisition::one_sided(right, z);
  EXPECT_GT(found.sigmas, 5);
  // 460 entries of 0.1, half of whose squares are antisymmetric; 480 signs tell it to √(2/480) · 2 of itself.
  EXPECT_NEAR(found.energy, 0.5 * 460 * 0.01, 0.5 * 460 * 0.01 * 0.2);
}

}  // namespace
}  // namespace symrig::error_estimate_test
