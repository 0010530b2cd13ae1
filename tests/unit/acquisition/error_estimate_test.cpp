// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/error_estimate.hpp"

#include "acquisition/errors/checks.hpp"
#include "acquisition/errors/error_estimate.hpp"
#include "dense_scene.hpp"
#include "judged_capture.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::evaluate_test {
namespace {

/// The matrix scaled by `gain`, entry by entry as scalars.
TransportTensor as_tensor(const tests::DenseTransport& t, double gain) {
  const BlockTree tree(t.grid());
  TensorBuilder builder(tree, 1);
  for (std::int32_t i = 0; i < t.grid().size(); ++i)
    for (std::int32_t j = 0; j <= i; ++j) {
      const auto v = static_cast<float>(gain * t.at(tree.order()[i], tree.order()[j]));
      builder.add_scalar(i, j, std::span(&v, 1));
    }
  return std::move(builder).finish();
}

TEST(Evaluate, a_tensor_that_is_too_bright_by_a_tenth_errs_by_a_tenth_in_every_way) {
  const auto scene = tests::facing_planes(Grid{12, 14});
  const auto e = evaluate(as_tensor(scene, 1.1), scene.truth());
  ASSERT_TRUE(e.ok());
  for (const double error : {e->frobenius, e->indirect, e->flood, e->relight_bar, e->relight_random,
                             e->relight_natural, e->bar_indirect})
    EXPECT_NEAR(error, 0.1,
                168 * 0x1p-24 * 40);  // float sums over 168 pixels; signed probes cancel, hence the factor
}

TEST(Evaluate, the_exact_tensor_has_only_rounding) {
  const auto scene = tests::facing_planes(Grid{12, 14});
  const auto e = evaluate(as_tensor(scene, 1), scene.truth());
  for (const double error : {e->frobenius, e->indirect, e->flood, e->relight_bar, e->relight_random,
                             e->relight_natural, e->bar_indirect})
    EXPECT_LE(error, 0x1p-11 + 168 * 0x1p-24);  // entries off the diagonal are stored as halves
}

// A comparison with nothing, or with what is no number, is no error of 0 %.
TEST(Evaluate, refuses_a_truth_that_tells_nothing) {
  const auto scene = tests::facing_planes(Grid{12, 14});
  const auto truth = [&](const Image<float>& pattern) {
    Result<Image<float>> seen = scene.truth()(pattern);
    if (seen) seen->values()[17] = std::numeric_limits<float>::quiet_NaN();
    return seen;
  };
  const auto of_nan = evaluate(as_tensor(scene, 1), truth);
  ASSERT_FALSE(of_nan.ok());
  EXPECT_EQ(of_nan.error().code, ErrorCode::bad_value);
  EXPECT_NE(of_nan.error().line().find("the truth of pixel 17"), std::string::npos) << of_nan.error().line();
  class Blind final : public ForwardingProbe {
   public:
    using ForwardingProbe::ForwardingProbe;

   private:
    Result<std::vector<Radiance>> seen(std::span<const Pattern> /*patterns*/,
                                       Result<std::vector<Radiance>> photographs) override {
      if (photographs)
        for (Radiance& one : *photographs) std::ranges::fill(one.valid.values(), std::uint8_t{0});
      return photographs;
    }
  };
  const auto rig = *open_virtual_rig("sim:plane?size=12x14");
  Blind blind(*rig);
  const auto of_nothing = evaluate(as_tensor(scene, 1), blind);
  ASSERT_FALSE(of_nothing.ok());
  EXPECT_NE(of_nothing.error().line().find("no pixel"), std::string::npos) << of_nothing.error().line();
}

TEST(Evaluate, indirect_sees_what_frobenius_hides) {
  // Only the direct light is stored: the Frobenius error is small because the indirect light is, the indirect
  // error is everything.
  const auto scene = tests::facing_planes(Grid{12, 14}, 0.002);
  const BlockTree tree(scene.grid());
  TensorBuilder builder(tree, 1);
  for (std::int32_t i = 0; i < scene.grid().size(); ++i) {
    const int raster = tree.order()[i];
    const auto v = static_cast<float>(scene.at(raster, raster));
    builder.add_scalar(i, i, std::span(&v, 1));
  }
  const auto e = evaluate(std::move(builder).finish(), scene.truth());
  EXPECT_LT(e->frobenius, 0.02);
  EXPECT_NEAR(e->indirect, 1, 1e-6);
  EXPECT_NEAR(e->bar_indirect, 1, 1e-6);
}

TEST(Evaluate, another_grid_is_refused) {
  const auto scene = tests::facing_planes(Grid{6, 6});
  const auto other = tests::facing_planes(Grid{6, 7});
  const auto e = evaluate(as_tensor(scene, 1), [&](const Image<float>&) -> Result<Image<float>> {
    return other.apply(Image<float>(Grid{6, 7}));
  });
  ASSERT_FALSE(e.ok());
  EXPECT_EQ(e.error().code, ErrorCode::size_mismatch);
}

TEST(TestPatterns, are_the_same_everywhere_and_inside_their_range) {
  for (const Grid grid : {Grid{1, 1}, Grid{1, 9}, Grid{33, 20}}) {
    for (const auto& p : {bar_pattern(grid), natural_pattern(grid, 3), random_pattern(grid, 3)})
      for (const float v : p.values()) EXPECT_TRUE(v >= 0 && v <= 1);
    EXPECT_EQ(natural_pattern(grid, 3), natural_pattern(grid, 3));
  }
  EXPECT_NE(random_pattern(Grid{8, 8}, 3), random_pattern(Grid{8, 8}, 4));
}

}  // namespace

}  // namespace symrig::evaluate_test

namespace symrig::error_estimate_test {

// What a capture says of its own errors, against the truth: seeds and sizes that nothing was tuned on.

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

namespace symrig::further_checks_test {

// Held-out photographs that a capture takes in the end, while its estimated errors are unsure.

namespace {

using acquisition::Checks;
using acquisition::LogRange;
using tests::default_options;
using tests::DenseProbe;
using tests::DenseTransport;
using tests::Workbench;

constexpr Grid kGrid{16, 16};
constexpr std::size_t kPixels = 256;

std::vector<std::pair<std::int64_t, std::int64_t>> pairs(const std::vector<LogRange>& ranges) {
  std::vector<std::pair<std::int64_t, std::int64_t>> all;
  all.reserve(ranges.size());
  for (const LogRange& range : ranges) all.emplace_back(range.first, range.last);
  return all;
}

TEST(FurtherChecks, are_sets_of_other_random_pixels_with_their_own_numbers) {
  const DenseTransport scene = tests::facing_planes(kGrid);
  DenseProbe probe(scene);
  std::vector<Pattern> shown;
  probe.watch = [&](const Pattern& p) { shown.push_back(p); };
  Workbench bench(probe);
  auto checks = Checks::take(bench.tree, bench.photographer);
  const std::vector<acquisition::LitBlocks> flood{{{0, static_cast<std::int32_t>(kPixels)}}};
  ASSERT_TRUE(bench.photographer.take("flood-lit", flood).ok());
  for (int times = 0; times < 2; ++times)
    ASSERT_TRUE(checks->take_further(1, bench.tree, bench.photographer).ok());
  using Ranges = std::vector<std::pair<std::int64_t, std::int64_t>>;
  EXPECT_EQ(pairs(checks->ranges()), (Ranges{{0, 6}, {7, 11}, {11, 15}}));
  EXPECT_EQ(pairs(acquisition::remaining(checks->ranges(), 16)), (Ranges{{6, 7}, {15, 16}}));
  ASSERT_EQ(shown.size(), 15U);
  for (std::size_t set = 7; set < 15; set += 4)
    for (std::size_t i = 0; i < kPixels; ++i) {
      EXPECT_EQ(shown[set].values()[i] + shown[set + 1].values()[i], 1);
      EXPECT_EQ(shown[set + 2].values()[i] * shown[set + 3].values()[i], 0);
    }
  // Independent halves agree in half of the pixels, ± 5 √(n / 4).
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{0, 7}, {0, 11}, {7, 11}}) {
    int alike = 0;
    for (std::size_t i = 0; i < kPixels; ++i) alike += shown[a].values()[i] == shown[b].values()[i] ? 1 : 0;
    EXPECT_NEAR(alike, kPixels / 2.0, 5 * std::sqrt(kPixels / 4.0));
  }
  const auto held = *checks->held_out(bench.tree, bench.photographer);
  ASSERT_EQ(held.size(), 14U);
  for (std::size_t k = 6; k < held.size(); ++k) EXPECT_EQ(held[k].pattern, shown[k + 1]);
  EXPECT_EQ(held[6].name, "random half, set 2");
  EXPECT_EQ(held[13].name, "another 1/32, set 3");
}

/// Squared ratio of the estimated to the true `frobenius` error with `sets` sets, for an error of random
/// signs in every entry.
double squared_ratio(const DenseTransport& scene, int sets, std::uint64_t seed) {
  DenseProbe probe(scene);
  Workbench bench(probe);
  Random random(seed);
  double wrong = 0, all = 0;
  const auto order = bench.tree.order();
  for (std::int32_t a = 0; a < std::ssize(order); ++a)
    for (std::int32_t b = 0; b <= a; ++b) {
      const auto exact = static_cast<float>(scene.at(order[a], order[b]));
      const float value = exact + 0.05F * random.sign() * exact;
      const double times = a == b ? 1 : 2;
      wrong += times * std::pow(static_cast<double>(value) - static_cast<double>(exact), 2);
      all += times * std::pow(static_cast<double>(exact), 2);
      bench.known.add_scalar(a, b, std::span(&value, 1));
    }
  auto checks = Checks::take(bench.tree, bench.photographer);
  EXPECT_TRUE(checks->take_further(sets - 1, bench.tree, bench.photographer).ok());
  const TransportTensor tensor = bench.known.tensor();
  const GainMismatch no_mismatch;
  acquisition::CheckSums sums(tensor, no_mismatch, checks->sets());
  EXPECT_TRUE(checks->visit_sets(bench.photographer, [&](auto set) { sums.add(set); }).ok());
  sums.finish();
  const double estimated = estimate_errors(sums).value.frobenius;
  return estimated * estimated / (wrong / all);
}

TEST(FurtherChecks, make_the_estimate_as_much_surer_as_independent_samples_do) {
  // The halves of one set are the same in all tries, so that the signs of the error make the scatter. With m
  // independent sets its variance is 1/m of that of one. A ratio of two variances of n values scatters by
  // √(4 / n): five of that.
  const DenseTransport scene = tests::facing_planes(kGrid);
  constexpr int kTries = 60, kSets = 4;
  const auto variance = [&](int sets) {
    double sum = 0, squares = 0;
    for (int k = 0; k < kTries; ++k) {
      const double ratio = squared_ratio(scene, sets, 1000 + k);
      sum += ratio;
      squares += ratio * ratio;
    }
    const double mean = sum / kTries;
    return squares / kTries - mean * mean;
  };
  const double share = variance(kSets) / variance(1);
  EXPECT_LT(share, 1.0 / kSets * (1 + 5 * std::sqrt(4.0 / kTries)));
}

/// Two captures, with and without further checks.
struct Both {
  CaptureResult without, with;
};

Both both(const std::string& uri) {
  CaptureOptions six = default_options();
  six.economy->check_share = 0;
  const auto once = open_virtual_rig(uri), again = open_virtual_rig(uri);
  EXPECT_TRUE(once.ok() && again.ok()) << uri;
  return {*capture(**once, six), *capture(**again, default_options())};
}

class FurtherChecksOf : public testing::TestWithParam<const char*> {};

TEST_P(FurtherChecksOf, change_the_estimates_and_nothing_else) {
  const std::string uri = GetParam();
  const Both captures = both(uri);
  const std::int64_t further = captures.with.patterns - captures.without.patterns;
  ASSERT_GT(further, 0) << uri;
  EXPECT_EQ(further % Checks::kFurther, 0) << uri;
  EXPECT_LE(static_cast<double>(further),
            default_economy(Algorithm::symrig).check_share * static_cast<double>(captures.without.patterns))
      << uri;
  EXPECT_EQ(captures.with.held_out.size(), 6U + static_cast<std::size_t>(further)) << uri;
  EXPECT_EQ(captures.with.patterns_per_level.back(), captures.without.patterns_per_level.back() + further)
      << uri;
  // The tensor: equal pictures of equal light.
  const Image<float> light = natural_pattern(captures.with.tensor.projector_grid(), 4);
  EXPECT_EQ(*captures.with.tensor.apply(light), *captures.without.tensor.apply(light)) << uri;
  EXPECT_EQ(captures.with.tensor.bytes(), captures.without.tensor.bytes()) << uri;
  // They show other light than the flood-lit photographs before them, which tell the noise.
  EXPECT_EQ(captures.with.noise_check.variance_ratio, captures.without.noise_check.variance_ratio) << uri;
  EXPECT_EQ(captures.with.noise_check.shared_ratio, captures.without.noise_check.shared_ratio) << uri;
  EXPECT_EQ(captures.with.noise_check.lamp, captures.without.noise_check.lamp) << uri;
  EXPECT_LT(captures.with.estimated_half_width.flood, captures.without.estimated_half_width.flood) << uri;
}
INSTANTIATE_TEST_SUITE_P(Rigs, FurtherChecksOf,
                         testing::Values("sim:random?seed=5&size=32x32&noise=camera",
                                         "sim:gummy?size=40x32&seed=921"));

TEST(FurtherChecks, stay_within_a_budget_of_photographs) {
  const std::string uri = "sim:random?seed=5&size=32x32&noise=camera";
  const std::int64_t needed = both(uri).without.patterns;
  for (const std::int64_t more : {0, 3, 4, 5}) {
    const auto rig = open_virtual_rig(uri);
    CaptureOptions options = default_options();
    options.max_patterns = needed + more;
    const auto result = capture(**rig, options);
    ASSERT_TRUE(result.ok());
    EXPECT_LE(result->patterns, needed + more);
  }
}

TEST(FurtherChecks, are_not_taken_where_the_estimates_are_sure) {
  // Noise-free direct light is right to rounding, or exactly dark between pixels.
  const auto rig = open_virtual_rig("sim:plane?size=32x32&noise=off");
  EXPECT_EQ(capture(**rig, default_options())->held_out.size(), 6U);
}

}  // namespace

}  // namespace symrig::further_checks_test
