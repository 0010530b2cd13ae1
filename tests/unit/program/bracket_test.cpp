// SPDX-License-Identifier: Apache-2.0
#include "program/timing.hpp"
#include "symrig/program/compile.hpp"
#include "unit/board/bench.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bracket_test {
namespace {

using namespace std::chrono_literals;

using Brackets = std::vector<std::vector<Nanoseconds>>;

std::string error_of(const RigSetup& rig, const Brackets& brackets) {
  const auto program = compile_brackets(rig, test::default_info(), brackets);
  return program.ok() ? "" : program.error().line();
}

TEST(Bracket, photographs_with_the_same_exposures_cost_no_more_records) {
  const auto of = [](std::size_t photographs) {
    return compile_brackets(default_rig_setup(), test::default_info(), Brackets(photographs, {100us, 800us}));
  };
  const auto two = of(2);
  const auto many = of(800);
  ASSERT_OK(two);
  ASSERT_OK(many);
  EXPECT_EQ(two->program.records(), many->program.records());
  EXPECT_NE(two->program.hash(), many->program.hash());
  EXPECT_EQ(many->patterns, 800U);
  EXPECT_EQ(many->exposures, 1600U);
}

TEST(Bracket, exposures_are_those_asked_for_and_fall_on_the_right_pattern) {
  test::Bench bench;
  Board board = bench.connect();
  ASSERT_OK(board.configure({}));
  const Brackets brackets{{100us, 800us}, {6400us}, {6400us}, {200us, 20ms, 100us}};
  const auto compiled = compile_brackets(default_rig_setup(), board.info(), brackets);
  ASSERT_OK(compiled);
  EXPECT_EQ(compiled->exposures, 7U);
  const auto receipt = board.run(compiled->program, 10s);
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
  RigSetup rig = default_rig_setup().without(RigRole::projector).without(RigRole::vsync);
  for (RigLine& line : rig.lines) line.active_low = line.role == RigRole::camera;
  rig.camera.exposure_offset = 5us;
  const std::string camera = rig.line_name(RigRole::camera);
  ASSERT_OK(board.configure(std::vector<LineConfig>{{.line = camera, .safe_level = true, .capture = true}}));
  const std::vector<Nanoseconds> exposures{100us, 800us};
  const auto compiled = compile_brackets(rig, board.info(), Brackets(2, exposures));
  ASSERT_OK(compiled);
  const auto receipt = board.run(compiled->program, 10s);
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());
  std::vector<CapturedEdge> edges;
  for (const CapturedEdge& edge : receipt->edges)
    if (edge.line == board.info().line(camera)) edges.push_back(edge);
  ASSERT_EQ(edges.size(), 8U);
  for (std::size_t k = 0; k < 8; k += 2) {
    EXPECT_FALSE(edges[k].level);
    EXPECT_EQ((edges[k + 1].tick - edges[k].tick).count,
              board.info().rate.ticks(exposures[k / 2 % 2] - 5us).count);
  }
  EXPECT_TRUE(edges.back().level);
}

// The linter of program files judges them.
TEST(Bracket, each_broken_rule_of_the_devices_is_named_with_the_nearest_legal_value) {
  RigSetup rig = default_rig_setup();
  EXPECT_NE(error_of(rig, {{1ms}, {10us}}).find("exposure of 10 us: the shortest of"), std::string::npos);
  EXPECT_NE(error_of(rig, {{10us}}).find("bracket = [\"20 us\"]"), std::string::npos)
      << error_of(rig, {{10us}});
  rig.projector.whole_refresh_from_bits = 1;
  rig.projector.refresh = 16ms;
  EXPECT_NE(error_of(rig, {{20ms}}).find("[\"16 ms\"]"), std::string::npos) << error_of(rig, {{20ms}});
  EXPECT_NE(error_of(rig, {{25ms}}).find("[\"32 ms\"]"), std::string::npos) << error_of(rig, {{25ms}});
  EXPECT_EQ(error_of(rig, {{16ms, 32ms}}), "");
  rig = default_rig_setup();
  rig.projector.advance_pulse = 8ns;
  EXPECT_NE(error_of(rig, {{1ms}}).find("advance_pulse"), std::string::npos) << error_of(rig, {{1ms}});
  rig = default_rig_setup();
  rig.projector.vsync_timeout = 0ns;
  EXPECT_NE(error_of(rig, {{1ms}}).find("time-out"), std::string::npos) << error_of(rig, {{1ms}});
  for (RigLine& line : rig.lines)
    if (line.role == RigRole::camera) line.config.line = "shutter";
  EXPECT_NE(error_of(rig, {{1ms}}).find("no line 'shutter'"), std::string::npos) << error_of(rig, {{1ms}});
  EXPECT_NE(error_of(default_rig_setup(), {{}}).find("no exposures"), std::string::npos);
  EXPECT_NE(error_of(default_rig_setup(), {}).find("no photographs"), std::string::npos);
}

TEST(Bracket, a_gap_shorter_than_the_readout_is_refused) {
  const auto program = compile_brackets(default_rig_setup(), test::default_info(), Brackets{{1ms}}, 1ms);
  ASSERT_FALSE(program.ok());
  EXPECT_NE(program.error().line().find("gap = \"4 ms\""), std::string::npos) << program.error().line();
}

TEST(Bracket, without_vsync_the_run_ends_with_a_time_out) {
  board_sim::SimBoard sim;  // nothing is wired to it
  Board board = test::Bench::connect(make_sim_link(sim));
  ASSERT_OK(board.configure({}));
  const RigSetup rig = default_rig_setup();
  const auto compiled = compile_brackets(rig, board.info(), Brackets{{1ms}});
  ASSERT_OK(compiled);
  const auto receipt = board.run(compiled->program, 10s);
  ASSERT_OK(receipt);
  EXPECT_EQ(receipt->end, RunEnd::wait_timeout);
  EXPECT_EQ(receipt->duration(), rig.projector.advance_pulse + 40ns + rig.projector.vsync_timeout);
}

}  // namespace
}  // namespace symrig::bracket_test

namespace symrig::longer_bracket_test {
namespace {

using namespace std::chrono_literals;
using Bracket = std::vector<Nanoseconds>;

TEST(LongerBracket, raises_the_one_that_is_too_short) {
  EXPECT_EQ(program::longer_bracket({3us, 1ms, 4ms}, 30us), (Bracket{30us, 1ms, 4ms}));
  EXPECT_EQ(program::longer_bracket({1ms, 4ms}, 30us), (Bracket{1ms, 4ms}));
}

// Five exposures of 30 us see no more than one.
TEST(LongerBracket, keeps_its_ratios_where_several_are_too_short) {
  EXPECT_EQ(program::longer_bracket({1us, 2us, 4us, 8us, 16us}, 30us),
            (Bracket{30us, 60us, 120us, 240us, 480us}));
  EXPECT_EQ(program::longer_bracket({4us, 1us, 2us}, 30us), (Bracket{120us, 30us, 60us}));
}

TEST(LongerBracket, whole_refreshes_stay_different) {
  const auto whole = [](Nanoseconds exposure) {
    return std::max<std::int64_t>(1, (exposure + 8ms) / 16ms) * Nanoseconds(16ms);
  };
  EXPECT_EQ(program::longer_bracket({1ms, 2ms, 4ms, 8ms}, 16ms, whole), (Bracket{16ms, 32ms, 64ms, 128ms}));
  EXPECT_EQ(program::longer_bracket({10ms, 40ms}, 16ms, whole), (Bracket{16ms, 48ms}));
}

TEST(LongerBracket, what_was_equal_stands_there_once) {
  EXPECT_EQ(program::longer_bracket({1us, 1us, 1us}, 30us), (Bracket{30us}));
  EXPECT_EQ(program::longer_bracket({0us, 0us, 5us}, 30us), (Bracket{30us, 150ms}));
  EXPECT_EQ(program::longer_bracket({}, 30us), Bracket{});
}

}  // namespace
}  // namespace symrig::longer_bracket_test
