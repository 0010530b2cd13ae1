// SPDX-License-Identifier: Apache-2.0
// What a capture says of its own errors, against the truth: seeds and sizes that nothing was tuned on.
#include "symrig/acquisition/error_estimate.hpp"

#include "acquisition/errors/energy_sums.hpp"
#include "acquisition/errors/one_sided.hpp"
#include "dense_scene.hpp"
#include "symrig/acquisition/measured_errors.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig {
namespace {

using tests::default_options;

constexpr std::array<double TransportErrors::*, 7> kErrors{
    &TransportErrors::frobenius,   &TransportErrors::indirect,       &TransportErrors::flood,
    &TransportErrors::relight_bar, &TransportErrors::relight_random, &TransportErrors::relight_natural,
    &TransportErrors::bar_indirect};

struct Judged {
  CaptureResult result;
  TransportErrors truth;
};

Judged judge(const std::string& uri, std::int64_t most = 0) {
  const auto rig = sim::open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << uri;
  CaptureOptions options = default_options();
  options.max_patterns = most;
  auto result = capture(**rig, options);
  EXPECT_TRUE(result.ok()) << uri;
  const sim::Scene& scene = (*rig)->truth();
  const auto truth =
      evaluate(result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return scene.apply(p); });
  return {*std::move(result), *truth};
}

/// Counts how often the truth lies within the stated interval.
struct Coverage {
  int inside = 0, all = 0, narrow = 0;
  std::string missed;

  void add(const std::string& uri, const Judged& judged) {
    for (std::size_t k = 0; k < kErrors.size(); ++k) {
      const double value = (*judged.result.estimated).*kErrors[k];
      const double width = judged.result.estimated_half_width.*kErrors[k];
      if (std::isnan(value)) continue;
      const double truth = judged.truth.*kErrors[k];
      const bool in = std::abs(truth - value) <= width + 1e-6;
      ++all;
      inside += in ? 1 : 0;
      narrow += width < value ? 1 : 0;
      if (!in)
        missed += uri + " " + std::to_string(k) + ": " + std::to_string(truth) + " not in " +
                  std::to_string(value) + " +- " + std::to_string(width) + "\n";
    }
  }
  /// At the stated confidence, less three standard deviations of a binomial count.
  double least() const { return all * kErrorConfidence - 3 * std::sqrt(all * 0.95 * 0.05); }
};

constexpr const char* kScenes[] = {"plane", "vgroove-white", "vgroove-mixed", "vgroove-textured",
                                   "gummy", "occluder",      "mirror",        "views2",
                                   "views3"};

TEST(ErrorEstimate, the_truth_lies_within_the_stated_interval) {
  int narrow = 0, all = 0;
  for (const char* keys :
       {"?size=36x44&seed=907", "?size=36x44&seed=908&noise=off", "?size=29x31&seed=909&psf=0.08"}) {
    Coverage coverage;
    for (const char* scene : kScenes) {
      const std::string uri = std::string("sim:") + scene + keys;
      coverage.add(uri, judge(uri));
    }
    EXPECT_GE(coverage.inside, coverage.least()) << coverage.missed;
    narrow += coverage.narrow;
    all += coverage.all;
  }
  // With noise about as large as the errors on so few pixels, intervals of some errors reach down to 0: of
  // the third group, where light spreads, two of three do.
  EXPECT_GT(narrow, all / 3) << "intervals say something";
}

TEST(ErrorEstimate, of_a_search_that_a_budget_ended_too) {
  for (const std::int64_t most : {8, 24, 60}) {
    Coverage coverage;
    for (const char* scene : kScenes) {
      const std::string uri = std::string("sim:") + scene + "?size=33x40&seed=911";
      coverage.add(uri, judge(uri, most));
    }
    EXPECT_GE(coverage.inside, coverage.least()) << most << "\n" << coverage.missed;
  }
}

TEST(ErrorEstimate, is_not_given_where_no_light_is_seen) {
  const Judged plane = judge("sim:plane?size=32x32&seed=912");
  EXPECT_TRUE(std::isnan(plane.result.estimated->indirect));
  EXPECT_TRUE(std::isnan(plane.result.estimated->bar_indirect));
  ASSERT_EQ(plane.result.estimate_not_given.size(), 2U);
  EXPECT_EQ(plane.result.estimate_not_given[0].key, "indirect");
  EXPECT_NE(plane.result.estimate_not_given[0].reason.find("noise"), std::string::npos);
}

TEST(ErrorEstimate, of_indirect_light_is_within_its_interval_or_not_given_on_misaligned_rigs) {
  int given = 0, inside = 0;
  for (const char* scene : {"plane", "vgroove-textured", "gummy", "occluder"})
    for (const char* shift : {"0.1", "0.4", "1"}) {
      const std::string uri = std::string("sim:") + scene + "?size=28x32&seed=913&misalign=" + shift;
      const Judged judged = judge(uri);
      const double value = judged.result.estimated->indirect;
      if (std::isnan(value)) {
        EXPECT_NE(judged.result.estimate_not_given[0].reason.find("one side"), std::string::npos) << uri;
        continue;
      }
      ++given;
      inside +=
          std::abs(value - judged.truth.indirect) <= judged.result.estimated_half_width.indirect ? 1 : 0;
    }
  EXPECT_LE(given - inside, 1) << "of " << given;
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
  const auto scene = sim::make_scene(*sim::parse_scene_uri("sim:mirror?size=32x32&seed=915&noise=off"));
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
}  // namespace symrig
