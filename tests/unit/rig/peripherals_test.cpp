// SPDX-License-Identifier: Apache-2.0
#include "sim/simulated_camera.hpp"
#include "sim/simulated_projector.hpp"
#include "symrig/boards/sim_board.hpp"

#include <gtest/gtest.h>

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
