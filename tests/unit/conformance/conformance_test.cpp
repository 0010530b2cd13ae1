// SPDX-License-Identifier: Apache-2.0
// The board passes every check that needs no wire, and with a wire all of them; and for each check there is a
// board, broken in one way, that fails it.
#include "symrig/conformance/conformance.hpp"

#include "broken_boards.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/protocol/messages.hpp"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <functional>
#include <memory>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::conformance_test {
namespace {

using test::Breaks;
using test::Broken;
using test::BrokenLink;

/// A wire from output 0 to an input.
class Wire final : public board_sim::Peripheral {
 public:
  explicit Wire(int input) : input_(input) {}
  void outputs_changed(std::uint64_t, std::uint32_t levels, board_sim::SimBoard& board) override {
    board.set_input(input_, (levels & 1U) != 0);
  }
  std::uint64_t next_event() const override { return board_sim::kNever; }
  void on_event(std::uint64_t, board_sim::SimBoard&) override {}

 private:
  int input_;
};

/// What fails on a board behind those breaks.
std::set<std::string> failures(const Breaks& breaks, const std::string& filter = "", bool jumper = false) {
  board_sim::SimBoard board;
  Wire wire(board.line("interlock"));
  if (jumper) board.attach(wire);
  ConformanceOptions options;
  options.filter = filter;
  if (jumper) options.jumper = Jumper{"projector_trigger", "interlock"};
  auto report = check_conformance(std::make_unique<BrokenLink>(make_sim_link(board), breaks), options);
  if (!report) return {report.error().what};
  std::set<std::string> failed;
  for (const CheckResult& result : report->results) {
    if (result.outcome == CheckOutcome::failed) failed.insert(result.name);
    EXPECT_EQ(result.outcome == CheckOutcome::passed, result.detail.empty()) << result.name;
  }
  return failed;
}

TEST(Conformance, simulated_board_passes) {
  board_sim::SimBoard board;
  const auto report = check_conformance(make_sim_link(board));
  ASSERT_TRUE(report.ok()) << report.error().line();
  for (const CheckResult& result : report->results)
    EXPECT_NE(result.outcome, CheckOutcome::failed) << result.name << ": " << result.detail;
  EXPECT_TRUE(report->passed());
  EXPECT_EQ(report->results.size(), conformance_checks().size());
  std::set<std::string> skipped;
  for (const CheckResult& result : report->results)
    if (result.outcome == CheckOutcome::skipped) skipped.insert(result.name);
  EXPECT_EQ(skipped, (std::set<std::string>{"interlock.short_opening", "interlock.trips", "jumper.levels",
                                            "jumper.stamps", "rules.refill", "rules.wait_kind"}));
  EXPECT_EQ(board.supervisor_state(), symrig_wire_State_STATE_SAFE);
  EXPECT_EQ(board.levels() & 7U, 0U);
}

/// Every one is found out, and not because nothing works behind the wrapper: with no break all checks pass.
std::set<std::string> expect_found(const std::vector<Broken>& boards) {
  std::set<std::string> found;
  for (const Broken& board : boards) {
    const std::set<std::string> failed = failures(board.breaks, board.filter);
    for (const std::string& name : board.found_by)
      EXPECT_TRUE(failed.contains(name)) << "a board that " << board.how << " passes " << name;
    found.insert(board.found_by.begin(), board.found_by.end());
  }
  return found;
}

TEST(Conformance, wrapper_alone_breaks_nothing) {
  const auto nothing = [](protocol::FrameHeader&, test::Bytes&) { return true; };
  EXPECT_EQ(failures({.from_board = nothing, .to_board = nothing}), std::set<std::string>{});
}

TEST(Conformance, jumper_checks) {
  EXPECT_EQ(failures({}, "^jumper|^interlock", true), std::set<std::string>{});
}

TEST(Conformance, each_check_can_fail) {
  std::set<std::string> found;
  for (const auto& boards :
       {test::broken_wires(), test::broken_refusals(), test::broken_words(), test::broken_watches()})
    found.merge(expect_found(boards));
  // A jumper that is told of but not there.
  board_sim::SimBoard board;
  ConformanceOptions options;
  options.filter = "^jumper|^interlock.(trips|short)";
  options.jumper = Jumper{"projector_trigger", "interlock"};
  const auto report = check_conformance(make_sim_link(board), options);
  ASSERT_TRUE(report.ok());
  for (const CheckResult& result : report->results)
    if (result.outcome == CheckOutcome::failed) found.insert(result.name);
  for (const CheckInfo& check : conformance_checks())
    EXPECT_TRUE(found.contains(std::string(check.name))) << check.name << " was never seen to fail";
}

/// Software makes its edges. What is late is told, so that it passes as a board that is in time does.
TEST(Conformance, best_effort_board_passes_with_late_words_that_it_tells) {
  constexpr std::uint32_t kLateness = 100;
  for (const std::uint32_t delay : {0U, kLateness, kLateness + 1, 50 * kLateness}) {
    EXPECT_EQ(failures(test::best_effort(kLateness, delay, true)), std::set<std::string>{}) << delay;
    EXPECT_EQ(failures(test::best_effort(kLateness, delay, true), "^jumper", true), std::set<std::string>{})
        << delay;
  }
  EXPECT_EQ(failures(test::best_effort(kLateness, 5 * kLateness, false), "^jumper", true),
            std::set<std::string>{"jumper.stamps"})
      << "it hides what is late";
}

/// Takes the processor from the firmware amid a run, as a busy machine does: the engine runs dry.
class BusyMachine final : public board_sim::Peripheral {
 public:
  explicit BusyMachine(int times) : times_(times) {}
  void outputs_changed(std::uint64_t, std::uint32_t, board_sim::SimBoard&) override {}
  std::uint64_t next_event() const override { return next_; }
  void on_event(std::uint64_t tick, board_sim::SimBoard& board) override {
    const std::uint64_t ms = board.config().tick_hz / 1000;
    next_ = tick + 10 * ms;
    const bool running = board.supervisor_state() == symrig_wire_State_STATE_RUNNING;
    if (running && !was_running_ && times_ > 0) {
      --times_;
      board.stall_firmware_until(tick + 100 * ms);
    }
    was_running_ = running;
  }
  int left() const { return times_; }

 private:
  int times_;
  bool was_running_ = false;
  std::uint64_t next_ = 0;
};

/// The outcome of a long run where the machine is busy so many times.
CheckOutcome long_run(int busy, const Breaks& breaks) {
  board_sim::SimBoard board;
  BusyMachine machine(busy);
  board.attach(machine);
  ConformanceOptions options;
  options.filter = "^events.lost";
  const auto report = check_conformance(std::make_unique<BrokenLink>(make_sim_link(board), breaks), options);
  EXPECT_TRUE(report.ok() && report->results.size() == 1);
  if (!report) return CheckOutcome::skipped;
  EXPECT_EQ(machine.left(), std::max(0, busy - 3)) << "attempts";
  return report->results.front().outcome;
}

TEST(Conformance, an_underrun_of_a_best_effort_board_is_looked_at_again_but_not_for_ever) {
  const Breaks best_effort = test::best_effort(100, 0, true);
  EXPECT_EQ(long_run(0, best_effort), CheckOutcome::passed);
  EXPECT_EQ(long_run(2, best_effort), CheckOutcome::passed);
  EXPECT_EQ(long_run(3, best_effort), CheckOutcome::failed);
}

TEST(Conformance, an_underrun_of_a_board_in_hardware_is_a_failure) {
  board_sim::SimBoard board;
  BusyMachine machine(1);
  board.attach(machine);
  ConformanceOptions options;
  options.filter = "^events.lost";
  const auto report = check_conformance(make_sim_link(board), options);
  ASSERT_TRUE(report.ok()) << report.error().line();
  EXPECT_EQ(report->results.front().outcome, CheckOutcome::failed);
  EXPECT_EQ(machine.left(), 0);
}

/// A board whose firmware takes time, and says so.
TEST(Conformance, slow_board_passes) {
  board_sim::SimBoardConfig config;
  config.refill_ticks = 100;
  config.poll_ticks = 2000;
  config.tick_hz = 1'000'000;
  config.min_dwell = 2;
  config.wait_latency = 3;
  board_sim::SimBoard board(config);
  const auto report = check_conformance(make_sim_link(board));
  ASSERT_TRUE(report.ok()) << report.error().line();
  for (const CheckResult& result : report->results)
    EXPECT_NE(result.outcome, CheckOutcome::failed) << result.name << ": " << result.detail;
}

TEST(Conformance, wrong_options_are_refused) {
  board_sim::SimBoard board;
  const auto error = [&](const ConformanceOptions& options) {
    const auto report = check_conformance(make_sim_link(board), options);
    return report.ok() ? "" : report.error().line();
  };
  ConformanceOptions options;
  options.filter = "(";
  EXPECT_EQ(error(options), "'(' is not a regular expression; for example ^wire or host_loss");
  options.filter = "nonsense";
  EXPECT_EQ(error(options), "no check's name matches 'nonsense'; docs/conformance.md lists them");
  options.filter = "";
  options.jumper = Jumper{"lamp", "vsync"};
  EXPECT_EQ(error(options), "the board has no output 'lamp'; projector_trigger, camera_trigger, lamp_enable");
}

TEST(Conformance, ends_safe_when_stopped) {
  board_sim::SimBoard board;
  int left = 60;
  ConformanceOptions options;
  options.stop = [&] { return --left == 0; };
  const auto report = check_conformance(make_sim_link(board), options);
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::interrupted);
  EXPECT_EQ(board.supervisor_state(), symrig_wire_State_STATE_SAFE);
}

/// The list of docs/conformance.md is that of the checks.
TEST(Conformance, documented) {
  std::ifstream file(SYMRIG_DOCS_DIR "/conformance.md");
  std::stringstream text;
  text << file.rdbuf();
  std::vector<std::string> listed;
  const std::string page = text.str();
  const std::regex row(R"(\n- `([a-z_]+\.[a-z_0-9]+)`: ([^\n]+))");
  for (std::sregex_iterator found(page.begin(), page.end(), row), end; found != end; ++found)
    listed.push_back((*found)[1].str() + ": " + (*found)[2].str());
  std::vector<std::string> checks;
  for (const CheckInfo& check : conformance_checks())
    checks.push_back(std::string(check.name) + ": " + std::string(check.what));
  EXPECT_EQ(listed, checks);
}

}  // namespace
}  // namespace symrig::conformance_test
