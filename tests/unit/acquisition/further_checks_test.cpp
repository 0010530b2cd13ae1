// SPDX-License-Identifier: Apache-2.0
// Held-out photographs that a capture takes in the end, while its estimated errors are unsure.
#include "acquisition/errors/checks.hpp"
#include "acquisition/errors/error_estimate.hpp"
#include "dense_scene.hpp"
#include "judged_capture.hpp"
#include "symrig/acquisition/capture.hpp"
#include "workbench.hpp"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::further_checks_test {
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
