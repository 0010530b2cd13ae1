// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/self_test.hpp"

#include "bench.hpp"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

namespace symrig::self_test_test {
namespace {

using namespace std::chrono_literals;

Board board_at(const std::string& uri) {
  auto link = open_link(*DeviceUri::parse(uri));
  EXPECT_TRUE(link.ok());
  return test::Bench::connect(std::move(link).value());
}

const SelfCheck& check(const SelfTest& test, const std::string& name) {
  const auto found = std::find_if(test.checks.begin(), test.checks.end(),
                                  [&](const SelfCheck& one) { return one.name == name; });
  EXPECT_NE(found, test.checks.end()) << name;
  return *found;
}

TEST(Board, idles_to_the_nanosecond_and_ends) {
  test::Bench bench;
  Board board = bench.connect();
  for (const Nanoseconds rest : {1ns, 3ns, 5ns, 11ns, 333'333'333ns}) ASSERT_OK(board.idle(rest));
  EXPECT_GE(bench.sim.now() * 8, 333'333'353U);
}

TEST(SelfTest, a_sound_board_passes_without_a_wire) {
  Board board = board_at("sim:");
  const auto test = self_test(board, {});
  ASSERT_OK(test);
  EXPECT_TRUE(test->passed());
  EXPECT_EQ(test->checks.size(), 5U);
  EXPECT_TRUE(test->pulses.empty());
  // No time passes on the way to a simulated board: what remains is a tick and the rounding, 2.2 s of age at
  // most 5 kHz of wander's allowance, and nothing of the drift that the first eight answers do not settle.
  EXPECT_LE(test->clock_bound, 1us);
  EXPECT_LE(test->drift.lowest, 0);
  EXPECT_GE(test->drift.highest, 0);
}

TEST(SelfTest, a_jumper_measures_every_pulse) {
  Board board = board_at("sim:?jumper=lamp_enable:vsync");
  const auto test = self_test(board, {.pings = 1, .jumper = Jumper{"lamp_enable", "vsync"}});
  ASSERT_OK(test);
  EXPECT_TRUE(test->passed()) << check(*test, "jumper").text;
  // 8 ticks of 8 ns, eight times as long each, up to 80 ms.
  ASSERT_EQ(test->pulses.size(), 7U);
  std::uint64_t width = 8;
  for (const JumperPulse& pulse : test->pulses) {
    EXPECT_EQ(pulse.planned.count, width);
    EXPECT_EQ(pulse.measured.count, width);  // the simulated board stamps every tick
    EXPECT_EQ(pulse.delay.count, 0U);
    width *= 8;
  }
}

TEST(SelfTest, a_missing_wire_is_named) {
  Board board = board_at("sim:?jumper=lamp_enable:vsync");
  const auto test = self_test(board, {.pings = 1, .jumper = Jumper{"camera_trigger", "vsync"}});
  ASSERT_OK(test);
  EXPECT_FALSE(test->passed());
  EXPECT_NE(check(*test, "jumper").text.find("no edge arrived"), std::string::npos);
}

/// The camera's strobe follows its trigger, but only while the camera is not reading out: pulses get lost.
TEST(SelfTest, something_else_on_the_input_is_named) {
  Board board = board_at("sim:");
  const auto test = self_test(board, {.pings = 1, .jumper = Jumper{"camera_trigger", "camera_strobe"}});
  ASSERT_OK(test);
  EXPECT_FALSE(test->passed());
  EXPECT_NE(check(*test, "jumper").text.find("edges arrived for 7 pulses"), std::string::npos)
      << check(*test, "jumper").text;
}

/// A wire with a delay that differs for rising and falling edges, as a slow opto-coupler has.
class SlowWire final : public board_sim::Peripheral {
 public:
  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard&) override {
    const bool level = (levels >> 2U & 1U) != 0;
    if (level == level_) return;
    level_ = level;
    at_ = tick + (level ? 0 : 5);
  }
  std::uint64_t next_event() const override { return at_; }
  void on_event(std::uint64_t, board_sim::SimBoard& board) override {
    board.set_input(3, level_);
    at_ = board_sim::kNever;
  }

 private:
  bool level_ = false;
  std::uint64_t at_ = board_sim::kNever;
};

TEST(SelfTest, wrong_widths_are_named) {
  board_sim::SimBoard sim;
  SlowWire wire;
  sim.attach(wire);
  Board board = test::Bench::connect(make_sim_link(sim));
  const auto test = self_test(board, {.pings = 1, .jumper = Jumper{"lamp_enable", "vsync"}});
  ASSERT_OK(test);
  EXPECT_FALSE(test->passed());
  EXPECT_NE(check(*test, "jumper").text.find("was measured as"), std::string::npos)
      << check(*test, "jumper").text;
}

TEST(SelfTest, a_latched_fault_is_told_and_nothing_is_touched) {
  test::Bench bench;
  Board board = bench.connect();
  const std::vector<LineConfig> lines{{.line = "interlock", .trip_level = true}};
  ASSERT_OK(board.configure(lines));
  const auto program = ProgramBuilder(board.info()).hold(1s).end();
  ASSERT_OK(program);
  ASSERT_OK(board.upload(*program));
  ASSERT_OK(board.arm());
  ASSERT_OK(board.start());
  bench.sim.set_input(bench.sim.line("interlock"), true);
  ASSERT_OK(board.idle(1ms));
  const auto test = self_test(board, {.pings = 1});
  ASSERT_OK(test);
  EXPECT_FALSE(test->passed());
  EXPECT_NE(check(*test, "state").text.find("a fault is latched"), std::string::npos);
  EXPECT_EQ(board.status()->state, BoardState::fault);
}

TEST(SelfTest, a_running_board_is_left_alone) {
  test::Bench bench;
  Board board = bench.connect();
  ASSERT_OK(board.configure({}));
  const auto program = ProgramBuilder(board.info()).hold(10s).end();
  ASSERT_OK(board.upload(*program));
  ASSERT_OK(board.arm());
  ASSERT_OK(board.start());
  const auto test = self_test(board, {.pings = 1});
  ASSERT_FALSE(test.ok());
  EXPECT_EQ(test.error().code, ErrorCode::device_refused);
  EXPECT_EQ(board.status()->state, BoardState::running);
}

TEST(SelfTest, lines_of_the_jumper_are_checked_first) {
  Board board = board_at("sim:");
  EXPECT_EQ(self_test(board, {.jumper = Jumper{"vsync", "camera_strobe"}}).error().code,
            ErrorCode::bad_argument);
  EXPECT_EQ(self_test(board, {.jumper = Jumper{"lamp_enable", "camera_trigger"}}).error().code,
            ErrorCode::bad_argument);
  EXPECT_EQ(self_test(board, {.jumper = Jumper{"nothing", "vsync"}}).error().code, ErrorCode::unknown_name);
}

}  // namespace
}  // namespace symrig::self_test_test
