// SPDX-License-Identifier: Apache-2.0

#include "rig/lamp.hpp"

#include "sim/simulated_devices.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/boards/sim_board.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace symrig::lamp_test {

namespace {

constexpr Grid kGrid{10, 10};

/// A flood-lit photograph of this level in which every pixel is known to one part in a hundred: its sum is
/// known to 1e-3. `noise`: how many of those sigmas it is off.
Radiance flood(double level, double noise = 0) {
  return {Image<float>(kGrid, 1, static_cast<float>(level * (1 + 1e-3 * noise))),
          Image<float>(kGrid, 1, 1e-4F), Image<std::uint8_t>(kGrid, 1, 1)};
}

TEST(LampLog, knows_nothing_before_the_second_reference) {
  LampLog lamp(50, 0.02);
  EXPECT_EQ(lamp.until_due(0), 0);
  EXPECT_EQ(lamp.level_at(0).value, 1);
  lamp.observe(0, flood(0.5));
  EXPECT_EQ(lamp.until_due(1), 50);
  EXPECT_EQ(lamp.until_due(51), 0);
  EXPECT_EQ(lamp.level_at(30).value, 1);
}

// A drift of 10 % in 1,000 photographs against an expected 100 %: σ of the slope from eight readings 51 apart
// is 1e-3 / (51 √42) = 3e-6, τ = 1e-3: the pull to zero is 1e-5 of the slope.
TEST(LampLog, foretells_a_straight_drift) {
  LampLog lamp(50, 1);
  for (int n = 0; n <= 510; n += 51) lamp.observe(n, flood(1 - 1e-4 * n));
  for (const int n : {511, 540, 561}) EXPECT_NEAR(lamp.level_at(n).value, 1 - 1e-4 * n, 1e-5);
}

// Two readings, one sigma apart: the slope that they suggest, 1e-3 / 51, is as large as the expected drift of
// 2 % in 1,000 photographs, and its σ is √2 times that: the line takes τ² / (τ² + σ²) = 1 / 3 of it.
TEST(LampLog, does_not_take_noise_for_drift) {
  LampLog lamp(50, 0.02);
  lamp.observe(0, flood(1));
  lamp.observe(51, flood(1, 1));
  const double slope = lamp.level_at(151).value - lamp.level_at(51).value;
  EXPECT_NEAR(slope, 100 * 1e-3 / 51 / 3, 0.05 * 100 * 1e-3 / 51);
  EXPECT_LT(std::abs(lamp.level_at(51).value - 1), 1e-3);
}

// The stated sigma is that of the level: over many lamps that hold still, the mean square of its error over σ
// is at most 1 ± 5 √(2 / 400); less, because a slope of 0 is both expected and true. The level is in units of
// the first reference, which has noise of its own.
TEST(LampLog, states_its_error) {
  double sum = 0;
  constexpr int kLamps = 400;
  Random random(3);
  const auto normal = [&random] {
    return std::sqrt(-2 * std::log(1 - random.uniform())) * std::cos(2 * std::numbers::pi * random.uniform());
  };
  for (int i = 0; i < kLamps; ++i) {
    LampLog lamp(50, 0.02);
    const double first = normal();
    lamp.observe(0, flood(1, first));
    for (int k = 1; k < 6; ++k) lamp.observe(std::int64_t{51} * k, flood(1, normal()));
    const LampLevel level = lamp.level_at(51 * 5 + 25);
    sum += std::pow((level.value - 1 / (1 + 1e-3 * first)) / level.sigma, 2);
  }
  EXPECT_LE(sum / kLamps, 1 + 5 * std::sqrt(2.0 / kLamps));
  EXPECT_GE(sum / kLamps, 0.2);
}

TEST(LampLog, asks_often_while_the_lamp_drifts) {
  LampLog lamp(50, 0.02);
  std::int64_t n = 0;
  for (int k = 0; k < 6; ++k) {
    lamp.observe(n, flood(1 + 1e-4 * static_cast<double>(n)));  // 5 sigmas an interval
    EXPECT_EQ(lamp.until_due(n + 1), 50);
    n += 51;
  }
}

// A black scene has no level; nothing is divided by it.
TEST(LampLog, leaves_a_black_scene_alone) {
  LampLog lamp(50, 0.02);
  EXPECT_TRUE(lamp.observe(0, flood(0)));
  EXPECT_TRUE(lamp.observe(51, flood(0)));
  EXPECT_EQ(lamp.level_at(60).value, 1);
}

// Half the light at once is a jump, no drift: the level is what the last reference says, and stays.
TEST(LampLog, begins_anew_after_a_jump) {
  LampLog lamp(50, 0.02);
  lamp.observe(0, flood(1));
  lamp.observe(51, flood(1));
  lamp.observe(152, flood(0.5));
  EXPECT_NEAR(lamp.level_at(152).value, 0.5, 1e-3);
  EXPECT_NEAR(lamp.level_at(202).value, 0.5, 1e-3);
  EXPECT_EQ(lamp.until_due(153), 50);
}

// Where any drift is expected, half the light at once is one: the line through two readings would put the
// lamp out after another 51 photographs.
TEST(LampLog, does_not_foretell_more_than_a_tenth) {
  LampLog lamp(50, 100);
  EXPECT_TRUE(lamp.observe(0, flood(1)));
  EXPECT_TRUE(lamp.observe(51, flood(0.5)));
  EXPECT_NEAR(lamp.level_at(51).value, 0.5, 1e-3);
  EXPECT_NEAR(lamp.level_at(102).value, 0.45, 1e-3);
}

TEST(LampLog, says_when_the_lamp_is_out) {
  LampLog lamp(50, 0.02);
  EXPECT_TRUE(lamp.observe(0, flood(1)));
  EXPECT_FALSE(lamp.observe(51, flood(0)));
}

// Pixels that are invalid in either photograph do not count.
TEST(LampLog, compares_what_both_photographs_know) {
  LampLog lamp(50, 1);
  Radiance first = flood(1), second = flood(0.9);
  first.valid.at(0, 0) = 0;
  first.mean.at(0, 0) = 0;
  second.valid.at(5, 5) = 0;
  second.mean.at(5, 5) = 0;
  lamp.observe(0, first);
  lamp.observe(51, second);
  EXPECT_NEAR(lamp.level_at(51).value, 0.9, 2e-3);  // each reading is known to 1e-3
}

}  // namespace

}  // namespace symrig::lamp_test

namespace symrig::sim::peripherals_test {

namespace {

constexpr std::uint32_t kProjector = 1U << 0U;
constexpr std::uint32_t kCamera = 1U << 1U;

/// Peripherals on a board that nobody programs: the test moves time and lines by itself.
struct Bench {
  board_sim::SimBoard board;
  board_sim::SimProjector raster{board};
  board_sim::SimCamera shutter{board};
  SimulatedProjector projector{{2, 2}, raster, Nanoseconds{16'666'667}};

  Bench() {
    board.attach(raster);
    board.attach(shutter);
  }
  static std::uint64_t ms(double t) { return static_cast<std::uint64_t>(125'000 * t); }
  void outputs(double t, std::uint32_t levels) {
    board.advance_to(ms(t));
    raster.outputs_changed(board.now(), levels, board);
    shutter.outputs_changed(board.now(), levels, board);
  }
};

TEST(SimulatedProjector, shows_each_pattern_from_the_refresh_after_its_trigger) {
  Bench bench;
  const std::vector<Pattern> patterns{Pattern({2, 2}, 1, 0.25F), Pattern({2, 2}, 1, 0.5F)};
  ASSERT_TRUE(bench.projector.load(patterns).ok());
  bench.outputs(2, kProjector);
  bench.outputs(3, 0);
  bench.outputs(40, kProjector);
  bench.outputs(41, 0);
  bench.board.advance_to(Bench::ms(100));
  EXPECT_TRUE(bench.projector.shown(Bench::ms(4), Bench::ms(10)).empty());  // asked for, not yet refreshed
  using Lit = SimulatedProjector::Lit;
  EXPECT_EQ(bench.projector.shown(Bench::ms(20), Bench::ms(30)), (std::vector<Lit>{{0, 1.0}}));
  EXPECT_EQ(bench.projector.shown(Bench::ms(60), Bench::ms(90)), (std::vector<Lit>{{1, 1.0}}));
  const auto both = bench.projector.shown(Bench::ms(45), Bench::ms(55));  // the third refresh is at 50 ms
  ASSERT_EQ(both.size(), 2U);
  EXPECT_NEAR(both[0].share, 0.5, 0.01);
  EXPECT_NEAR(both[0].share + both[1].share, 1, 1e-12);
}

TEST(SimulatedProjector, starts_anew_with_each_sequence_and_counts_on) {
  Bench bench;
  ASSERT_TRUE(bench.projector.load(std::vector<Pattern>(3, Pattern({2, 2}))).ok());
  EXPECT_EQ(bench.projector.loaded_before(), 0U);
  ASSERT_TRUE(bench.projector.load(std::vector<Pattern>(2, Pattern({2, 2}))).ok());
  EXPECT_EQ(bench.projector.loaded_before(), 3U);
  EXPECT_EQ(bench.projector.load(std::vector<Pattern>(1, Pattern({2, 3}))).error().code,
            ErrorCode::size_mismatch);
}

TEST(SimulatedCamera, hands_over_what_was_exposed_with_its_times) {
  Bench bench;
  std::vector<SimulatedExposure> seen;
  SimulatedCamera camera({{2, 2}, 1, {}, NoiseModel::from_electrons({}), {}, 0}, bench.shutter,
                         [&](std::span<const SimulatedExposure> exposures) {
                           seen.assign(exposures.begin(), exposures.end());
                           return std::vector<CameraFrame>(exposures.size());
                         });
  for (const double t : {1.0, 21.0}) {
    bench.outputs(t, kCamera);
    bench.outputs(t + 8, 0);
  }
  ASSERT_TRUE(camera.take(2, Nanoseconds{0}).ok());
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].end - seen[0].begin, Bench::ms(8));
  EXPECT_EQ(seen[1].begin - seen[0].begin, Bench::ms(20));
  EXPECT_EQ(seen[1].sequence, 1U);
  EXPECT_TRUE((*camera.take(1, Nanoseconds{0})).empty()) << "nothing was exposed since";
  bench.outputs(60, kCamera);
  bench.outputs(61, 0);
  ASSERT_TRUE(camera.take(1, Nanoseconds{0}).ok());
  EXPECT_EQ(seen[0].sequence, 2U);
}

}  // namespace

}  // namespace symrig::sim::peripherals_test
