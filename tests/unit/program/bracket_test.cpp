// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/bracket.hpp"

#include "unit/board/bench.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig {
namespace {

using namespace std::chrono_literals;

std::string error_of(const RigProfile& profile, const std::vector<Nanoseconds>& exposures) {
  const auto program = compile_bracket(test::default_info(), profile, exposures, 1);
  return program.ok() ? "" : program.error().line();
}

TEST(Bracket, photographs_with_the_same_exposures_cost_no_more_records) {
  const std::vector<Nanoseconds> exposures{100us, 800us};
  const auto one = compile_bracket(test::default_info(), {}, exposures, 1);
  const auto many = compile_bracket(test::default_info(), {}, exposures, 800);
  ASSERT_OK(one);
  ASSERT_OK(many);
  EXPECT_EQ(one->records(), many->records());
  EXPECT_NE(one->hash(), many->hash());
}

TEST(Bracket, exposures_are_those_asked_for_and_fall_on_the_right_pattern) {
  test::Bench bench;
  Board board = bench.connect();
  ASSERT_OK(board.configure({}));
  const std::vector<std::vector<Nanoseconds>> brackets{{100us, 800us}, {6400us}, {200us, 20ms, 100us}};
  const auto program = compile_brackets(board.info(), {}, brackets);
  ASSERT_OK(program);
  const auto receipt = board.run(*program, 10s);
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());
  std::size_t frame = 0;
  for (std::size_t photograph = 0; photograph < brackets.size(); ++photograph)
    for (const Nanoseconds exposure : brackets[photograph]) {
      ASSERT_LT(frame, bench.camera.frames().size());
      const auto& got = bench.camera.frames()[frame++];
      EXPECT_EQ(got.end - got.begin, board.info().rate.ticks(exposure).count);
      EXPECT_EQ(bench.projector.pattern_at(got.begin), static_cast<std::int64_t>(photograph));
      EXPECT_EQ(bench.projector.pattern_at(got.end), static_cast<std::int64_t>(photograph));
    }
  EXPECT_EQ(frame, bench.camera.frames().size());
  EXPECT_EQ(bench.camera.missed_triggers(), 0);
}

// A camera that exposes while its line is low, 5 us longer than the pulse; nobody waits for a screen.
TEST(Bracket, lines_that_are_on_when_low_begin_and_end_high) {
  test::Bench bench;
  Board board = bench.connect();
  RigProfile profile;
  profile.projector_line.clear();
  profile.vsync_line.clear();
  profile.camera_active_low = true;
  profile.exposure_offset = 5us;
  ASSERT_OK(board.configure(
      std::vector<LineConfig>{{.line = profile.camera_line, .safe_level = true, .capture = true}}));
  const std::vector<Nanoseconds> exposures{100us, 800us};
  const auto program = compile_bracket(board.info(), profile, exposures, 2);
  ASSERT_OK(program);
  const auto receipt = board.run(*program, 10s);
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());
  std::vector<CapturedEdge> edges;
  for (const CapturedEdge& edge : receipt->edges)
    if (edge.line == board.info().line(profile.camera_line)) edges.push_back(edge);
  ASSERT_EQ(edges.size(), 8U);
  for (std::size_t k = 0; k < 8; k += 2) {
    EXPECT_FALSE(edges[k].level);
    EXPECT_EQ((edges[k + 1].tick - edges[k].tick).count,
              board.info().rate.ticks(exposures[k / 2 % 2] - 5us).count);
  }
  EXPECT_TRUE(edges.back().level);
}

TEST(Bracket, each_broken_rule_of_the_devices_is_named_with_the_nearest_legal_value) {
  RigProfile profile;
  EXPECT_EQ(error_of(profile, {10us}),
            "exposure of 10 us: the camera's shortest is 20 us; the nearest legal value is 20 us");
  profile.whole_refreshes = true;
  profile.refresh_period = 16ms;
  EXPECT_EQ(error_of(profile, {20ms}),
            "exposure of 20 ms is not whole refresh periods of 16 ms; the nearest legal value is 16 ms");
  EXPECT_EQ(error_of(profile, {25ms}),
            "exposure of 25 ms is not whole refresh periods of 16 ms; the nearest legal value is 32 ms");
  EXPECT_EQ(error_of(profile, {16ms, 32ms}), "");
  profile = {};
  profile.advance_pulse = 20ms;
  EXPECT_NE(error_of(profile, {1ms}).find("advance_pulse"), std::string::npos);
  profile = {};
  profile.settle = 0ns;
  EXPECT_NE(error_of(profile, {1ms}).find("settle"), std::string::npos);
  profile = {};
  profile.readout = 8ns;
  EXPECT_NE(error_of(profile, {1ms}).find("readout"), std::string::npos);
  profile = {};
  profile.vsync_timeout = 1ms;
  EXPECT_NE(error_of(profile, {1ms}).find("vsync_timeout"), std::string::npos);
  profile = {};
  profile.camera_line = "shutter";
  EXPECT_NE(error_of(profile, {1ms}).find("no output 'shutter'"), std::string::npos);
  EXPECT_NE(error_of({}, {}).find("no exposures"), std::string::npos);
}

TEST(Bracket, without_vsync_the_run_ends_with_a_time_out) {
  boards::SimBoard sim;  // nothing is wired to it
  Board board = test::Bench::connect(make_sim_link(sim));
  ASSERT_OK(board.configure({}));
  const std::vector<Nanoseconds> exposures{1ms};
  const auto program = compile_bracket(board.info(), {}, exposures, 1);
  ASSERT_OK(program);
  const auto receipt = board.run(*program, 10s);
  ASSERT_OK(receipt);
  EXPECT_EQ(receipt->end, RunEnd::wait_timeout);
  EXPECT_EQ(receipt->duration(), RigProfile{}.advance_pulse + 40ns + RigProfile{}.vsync_timeout);
}

}  // namespace
}  // namespace symrig
