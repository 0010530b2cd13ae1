// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/capture.hpp"

#include "dense_scene.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::capture_test {
namespace {

using tests::DenseProbe;
using tests::DenseTransport;
using tests::facing_planes;

CaptureOptions options_for(Algorithm algorithm) {
  CaptureOptions options;
  options.algorithm = algorithm;
  options.rule = default_rule(algorithm);
  options.economy = default_economy(algorithm);
  return options;
}

constexpr std::int64_t kChecks = 6;  // photographs that symrig holds out

class EveryAlgorithm : public testing::TestWithParam<Algorithm> {};
std::vector<Algorithm> all_algorithms() {
  std::vector<Algorithm> all;
  for (const AlgorithmInfo& one : algorithms()) all.push_back(one.algorithm);
  return all;
}

INSTANTIATE_TEST_SUITE_P(Algorithms, EveryAlgorithm, testing::ValuesIn(all_algorithms()),
                         [](const auto& algorithm) { return std::string(name(algorithm.param)); });

TEST_P(EveryAlgorithm, recovers_facing_planes_of_any_size) {
  for (const Grid grid : {Grid{1, 1}, Grid{1, 7}, Grid{9, 1}, Grid{2, 3}, Grid{16, 16}, Grid{13, 17}}) {
    const DenseTransport scene = facing_planes(grid);
    DenseProbe probe(scene);
    const auto result = capture(probe, options_for(GetParam()));
    ASSERT_TRUE(result.ok()) << result.error().line();
    const auto errors = evaluate(result->tensor, scene.truth());
    // A leaf may miss a sample by τ_A F + τ_R of its signal (RMS); entries add up over a pattern with random
    // signs at worst in full over a row: indirect light is 0.2 of the direct, so 0.02 · 0.2 + 3e-4 · √levels
    // is far above what may remain.
    EXPECT_LE(errors->frobenius, 0.006) << to_string(grid);
    EXPECT_LE(errors->flood, 0.006) << to_string(grid);
    EXPECT_EQ(result->patterns, probe.cost().photographs);
    std::int64_t sum = 0;
    for (const std::int64_t n : result->patterns_per_level) sum += n;
    EXPECT_EQ(sum, result->patterns);
  }
}

// The first photograph, which is taken before the search begins, must not be counted off the host's work.
TEST_P(EveryAlgorithm, waiting_for_the_rig_is_no_processing) {
  const DenseTransport scene = facing_planes({8, 8});
  DenseProbe probe(scene);
  bool first = true;
  probe.watch = [&](const Pattern&) {
    if (std::exchange(first, false)) std::this_thread::sleep_for(std::chrono::milliseconds(500));
  };
  const Stopwatch watch;
  const auto result = capture(probe, options_for(GetParam()));
  const double all = watch.seconds();
  ASSERT_TRUE(result.ok()) << result.error().line();
  EXPECT_GE(result->process_seconds, 0);
  EXPECT_LE(result->process_seconds, all - 0.5);
}

TEST_P(EveryAlgorithm, an_all_black_scene_stores_nothing) {
  const DenseTransport black(Grid{8, 8}, [](int, int) { return 0.0; });
  DenseProbe probe(black);
  CaptureOptions unchecked = options_for(GetParam());
  unchecked.unchecked = true;
  const auto result = capture(probe, unchecked);
  ASSERT_TRUE(result.ok()) << result.error().line();
  EXPECT_TRUE(result->tensor.factors()->empty());
  EXPECT_TRUE(result->tensor.scalars().empty() && result->tensor.column_rows().empty());
  EXPECT_LE(result->patterns, algorithm_info(GetParam()).tolerance ? 1 : 64);
}

TEST_P(EveryAlgorithm, a_photograph_with_nan_is_refused) {
  const DenseTransport scene = facing_planes(Grid{6, 6});
  DenseProbe probe(scene);
  probe.spoil = [](Radiance& photograph) {
    photograph.mean.values()[5] = std::numeric_limits<float>::quiet_NaN();
  };
  const auto result = capture(probe, options_for(GetParam()));
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::bad_value);
}

TEST_P(EveryAlgorithm, stops_when_told) {
  const DenseTransport scene = facing_planes(Grid{16, 16});
  DenseProbe probe(scene);
  CaptureOptions options = options_for(GetParam());
  options.progress = [](const ProgressEvent& event) { return event.done < 20; };
  const auto result = capture(probe, options);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::interrupted);
  EXPECT_LT(probe.cost().photographs, 64);
}

TEST_P(EveryAlgorithm, is_deterministic) {
  const DenseTransport scene = facing_planes(Grid{11, 12});
  DenseProbe first(scene, 1e-4), second(scene, 1e-4);
  const auto a = capture(first, options_for(GetParam()));
  const auto b = capture(second, options_for(GetParam()));
  EXPECT_TRUE(std::ranges::equal(*a->tensor.factors(), *b->tensor.factors()));
  EXPECT_TRUE(std::ranges::equal(a->tensor.scalar_values(), b->tensor.scalar_values()));
}

class Hierarchy : public testing::TestWithParam<Algorithm> {};
INSTANTIATE_TEST_SUITE_P(Algorithms, Hierarchy, testing::Values(Algorithm::symrig, Algorithm::paper),
                         [](const auto& algorithm) { return std::string(name(algorithm.param)); });

TEST_P(Hierarchy, a_rank_one_scene_takes_the_flood_and_one_check) {
  // T = v v': the flood-lit photograph is the whole answer, the four child photographs only confirm it.
  const DenseTransport scene(Grid{8, 8}, [](int i, int j) { return (1 + i % 5) * (1 + j % 5) / 2000.0; });
  DenseProbe probe(scene);
  const auto result = capture(probe, options_for(GetParam()));
  EXPECT_EQ(result->patterns, GetParam() == Algorithm::symrig ? 5 + kChecks : 5);
  ASSERT_EQ(result->tensor.leaves().size(), 1U);
  const auto errors = evaluate(result->tensor, scene.truth());
  constexpr double kStored = 0x1p-10 * (1 + 0x1p-11);  // both factors are stored as halves
  EXPECT_LE(errors->frobenius, kStored + 64 * 0x1p-24);
  EXPECT_LE(errors->relight_natural, kStored + 64 * 0x1p-24);
}

TEST_P(Hierarchy, a_diagonal_scene_is_exact_at_four_patterns_a_level) {
  const DenseTransport scene(Grid{16, 16}, [](int i, int j) { return i == j ? 0.2 + 0.05 * (i % 13) : 0.0; });
  DenseProbe probe(scene);
  const auto result = capture(probe, options_for(GetParam()));
  // symrig sees from its check photographs that all light is direct.
  EXPECT_EQ(result->patterns, GetParam() == Algorithm::symrig ? 1 + kChecks : 1 + 4 * 4);
  const auto errors = evaluate(result->tensor, scene.truth());
  EXPECT_EQ(errors->frobenius, 0);
}

TEST_P(Hierarchy, tensor_is_symmetric) {
  const DenseTransport scene = facing_planes(Grid{10, 14});
  DenseProbe probe(scene);
  const auto result = capture(probe, options_for(GetParam()));
  EXPECT_TRUE(result->tensor.symmetric());
  EXPECT_EQ(*result->tensor.apply(natural_pattern(scene.grid(), 2)),
            *result->tensor.apply_transposed(natural_pattern(scene.grid(), 2)));
}

TEST_P(Hierarchy, a_smaller_tolerance_gives_a_smaller_error_for_more_patterns) {
  const DenseTransport scene = facing_planes(Grid{20, 20});
  double last_error = 1;
  std::int64_t last_patterns = 0;
  for (const double tolerance : {3e-3, 3e-4, 3e-5}) {
    CaptureOptions options = options_for(GetParam());
    options.rule->flood_fraction = options.rule->empty_fraction = tolerance;
    options.rule->signal_fraction = 0;
    DenseProbe probe(scene);
    const auto result = capture(probe, options);
    const double error = evaluate(result->tensor, scene.truth())->indirect;
    EXPECT_LT(error, last_error);
    EXPECT_GE(result->patterns, last_patterns);
    last_error = error;
    last_patterns = result->patterns;
  }
}

TEST(CaptureSymrig, noise_without_a_scene_stores_nothing) {
  // 3 σ of a χ² sum over 256 samples: a false alarm of 0.1 %; the seed is fixed.
  const DenseTransport black(Grid{16, 16}, [](int, int) { return 0.0; });
  DenseProbe probe(black, 0.01);
  CaptureOptions unchecked = options_for(Algorithm::symrig);
  unchecked.unchecked = true;
  const auto result = capture(probe, unchecked);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->patterns, 1);
  EXPECT_TRUE(result->tensor.factors()->empty());
}

TEST(CaptureSymrig, noise_does_not_drive_it_to_a_full_scan) {
  const DenseTransport scene = facing_planes(Grid{32, 32});
  DenseProbe noisy(scene, 1e-3), clean(scene);
  const auto with_noise = capture(noisy, options_for(Algorithm::symrig));
  const auto without = capture(clean, options_for(Algorithm::symrig));
  EXPECT_LE(with_noise->patterns, without->patterns);
  // Each stored number carries a noise of about σ or less; the direct light is ~0.65: relative Frobenius
  // error ~σ/0.65 plus the clean one.
  EXPECT_LE(evaluate(with_noise->tensor, scene.truth())->frobenius, 0.01);
}

TEST(CaptureSymrig, a_dead_camera_pixel_is_seen_from_the_other_side) {
  // T_ij of a dead pixel i is measured at pixel j while i is lit (reciprocity); only T_ii itself cannot be.
  const DenseTransport scene = facing_planes(Grid{8, 8});
  constexpr int kDead = 19;
  DenseProbe probe(scene);
  probe.spoil = [](Radiance& photograph) {
    photograph.mean.values()[kDead] = 0;
    photograph.valid.values()[kDead] = 0;
  };
  CaptureOptions options = options_for(Algorithm::symrig);
  options.rule->flood_fraction = options.rule->empty_fraction = 0;
  options.rule->signal_fraction = 1e-4;
  const auto result = capture(probe, options);
  ASSERT_TRUE(result.ok()) << result.error().line();
  Image<float> lit(scene.grid());
  lit.values()[kDead] = 1;
  const auto estimate = result->tensor.apply(lit);
  const Image<float> truth = scene.apply(lit);
  double error = 0, energy = 0;
  for (int i = 0; i < 64; ++i) {
    if (i == kDead) continue;
    const std::size_t at = i;
    error += std::pow(estimate->values()[at] - truth.values()[at], 2);
    energy += std::pow(truth.values()[at], 2);
  }
  EXPECT_LE(std::sqrt(error / energy), 0.05);
}

TEST(Capture, a_blind_camera_is_named) {
  const DenseTransport scene = facing_planes(Grid{8, 8});
  DenseProbe probe(scene);
  probe.spoil = [](Radiance& photograph) { std::ranges::fill(photograph.valid.values(), std::uint8_t{0}); };
  const auto result = capture(probe, options_for(Algorithm::symrig));
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::bad_value);
}

TEST(Capture, a_memory_limit_is_kept) {
  const DenseTransport scene = facing_planes(Grid{16, 16});
  for (const Algorithm algorithm : {Algorithm::symrig, Algorithm::brute}) {
    DenseProbe probe(scene);
    CaptureOptions options = options_for(algorithm);
    options.memory_limit = 1000;
    const auto result = capture(probe, options);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::limit);
  }
}

TEST(Capture, algorithm_names_round_trip) {
  ASSERT_EQ(algorithm_names().size(), algorithms().size());
  for (std::size_t k = 0; k < algorithms().size(); ++k) {
    EXPECT_EQ(algorithm_names()[k], algorithms()[k].name);
    EXPECT_EQ(name(*parse_algorithm(algorithms()[k].name)), algorithms()[k].name);
  }
  EXPECT_EQ(algorithms().front().algorithm, CaptureOptions().algorithm);  // the default first
  EXPECT_EQ(parse_algorithm("Paper").error().code, ErrorCode::unknown_name);
}

}  // namespace
}  // namespace symrig::capture_test
