// SPDX-License-Identifier: Apache-2.0
// What can go wrong beyond the channel: hosts that die, processors that stand still, clocks that run over or
// drift, limits of which only one layer is left. Outputs are watched by something wired to them, never by the
// board's word.
#include "bench.hpp"
#include "faulty_link.hpp"
#include "symrig/board/program.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::faults_test {
namespace {

using namespace std::chrono_literals;
using test::Bench;

constexpr std::uint64_t kMs = 125'000;  // ticks
constexpr std::uint32_t kOutputs = 7;
constexpr std::uint32_t kSafe = 2;  // camera_trigger rests high
constexpr std::uint64_t kTtlMs = 60;

const std::vector<LineConfig> kLines{{.line = "camera_trigger", .safe_level = true},
                                     {.line = "lamp_enable", .hazard = Hazard::lamp, .max_on = 1s}};

/// When the outputs came to their safe levels for the last time.
class Watch final : public board_sim::Peripheral {
 public:
  std::uint64_t safe_since = 0;
  bool safe = false;

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard&) override {
    const bool now = (levels & kOutputs) == kSafe;
    if (now && !safe) safe_since = tick;
    safe = now;
  }
  std::uint64_t next_event() const override { return board_sim::kNever; }
  void on_event(std::uint64_t, board_sim::SimBoard&) override {}
};

/// A second with the lamp on now and then, or what is left of it; ends with projector_trigger high.
Program blinking(const BoardInfo& info, std::uint64_t rounds) {
  ProgramBuilder builder(info);
  builder.set("camera_trigger", true);
  builder.loop(rounds).set("lamp_enable", true).hold(100us).set("lamp_enable", false).hold(100us).end_loop();
  auto program = builder.set("projector_trigger", true).end();
  EXPECT_TRUE(program.ok()) << (program.ok() ? "" : program.error().line());
  return *std::move(program);
}

/// A board with a host, brought into a state in which it is not safe where the state allows that.
struct Rig {
  board_sim::SimBoard sim;
  Watch watch;
  Board board = Bench::connect(make_sim_link(sim), {.keep_alive = 60ms});

  Rig() { sim.attach(watch); }

  void enter(BoardState state) {
    if (state == BoardState::safe) return;
    EXPECT_TRUE(board.configure(kLines).ok());
    if (state == BoardState::configured) return by_hand();
    const bool ends = state == BoardState::done;
    EXPECT_TRUE(board.upload(blinking(board.info(), ends ? 3 : 5000)).ok());
    if (state == BoardState::loaded) return by_hand();
    EXPECT_TRUE(board.arm().ok());
    if (state == BoardState::armed) return;
    EXPECT_TRUE(board.start().ok());
    if (ends) {
      EXPECT_TRUE(board.wait(1s).ok());
    }
    if (state == BoardState::fault) sim.stall_firmware_until(sim.now() + 300 * kMs);
    if (state == BoardState::fault) sim.advance_to(sim.now() + 301 * kMs);
  }
  void by_hand() {
    EXPECT_TRUE(board.keep_alive(60ms).ok());
    EXPECT_TRUE(board.set_line("lamp_enable", true).ok());
  }
};

constexpr std::array kStates{BoardState::safe,  BoardState::configured, BoardState::loaded,
                             BoardState::armed, BoardState::running,    BoardState::done,
                             BoardState::fault};

TEST(HostDeath, silence_in_every_state_is_safe_in_time) {
  for (const BoardState state : kStates) {
    Rig rig;
    rig.enter(state);
    ASSERT_EQ(rig.sim.supervisor_state(), static_cast<int>(state)) << name(state);
    const std::uint64_t dies = rig.sim.now();
    rig.sim.advance_to(dies + (kTtlMs + 10) * kMs);
    EXPECT_EQ(rig.sim.levels() & kOutputs, rig.sim.safe_levels()) << name(state);
    if (state == BoardState::safe) continue;  // nothing has told it levels of its own yet
    EXPECT_TRUE(rig.watch.safe) << name(state);
    EXPECT_LE(rig.watch.safe_since, dies + (kTtlMs + 10) * kMs) << name(state);
    const std::uint64_t then = rig.watch.safe_since;
    rig.sim.advance_to(dies + 5000 * kMs);
    EXPECT_EQ(rig.watch.safe_since, then) << name(state);  // and stays so
  }
}

TEST(HostDeath, a_pulled_cable_in_every_state_is_safe_at_once) {
  for (const BoardState state : kStates) {
    Rig rig;
    rig.enter(state);
    rig.sim.set_attached(false);
    rig.sim.advance_to(rig.sim.now() + 1);
    EXPECT_EQ(rig.sim.levels() & kOutputs, rig.sim.safe_levels()) << name(state);
    rig.sim.set_attached(true);
    auto again = Board::connect(make_sim_link(rig.sim));
    ASSERT_OK(again);
    ASSERT_OK(again->status());
  }
}

TEST(Standstill, the_watchdog_makes_safe_in_every_state_and_is_told) {
  for (const BoardState state : kStates) {
    Rig rig;
    rig.enter(state);
    const std::uint64_t stands = rig.sim.now();
    rig.sim.stall_firmware_until(stands + 2000 * kMs);
    rig.sim.advance_to(stands + (board_sim::kSimWatchdogMs + 1) * kMs);
    EXPECT_EQ(rig.sim.supervisor_state(), static_cast<int>(BoardState::safe)) << name(state);
    EXPECT_EQ(rig.sim.levels() & kOutputs, 0U) << name(state);  // power-up levels: nothing is stored
    auto again = Board::connect(make_sim_link(rig.sim));
    ASSERT_OK(again);
    const auto status = again->status();
    ASSERT_OK(status);
    EXPECT_EQ(status->reset_cause, ResetCause::watchdog);
    ASSERT_TRUE(status->reset_fault.has_value());
    EXPECT_EQ(status->reset_fault->name, state == BoardState::fault ? "underrun" : "watchdog") << name(state);
  }
}

/// Short stalls are survived, long ones are an underrun: the engine is safe in the very tick in which it ran
/// dry.
TEST(Standstill, an_underrun_is_safe_in_its_tick_and_named) {
  for (const std::uint64_t stall : {1ULL, 5ULL, 20ULL, 60ULL, 200ULL}) {
    board_sim::SimBoardConfig config;
    config.engine_segments = 64;  // 6.4 ms of this program
    board_sim::SimBoard sim(config);
    Watch watch;
    sim.attach(watch);
    auto board = Board::connect(make_sim_link(sim));
    ASSERT_OK(board);
    ASSERT_OK(board->configure(kLines));
    ASSERT_OK(board->upload(blinking(board->info(), 2000)));
    ASSERT_OK(board->arm());
    ASSERT_OK(board->start());
    sim.advance_to(sim.now() + 10 * kMs);
    const std::uint64_t stands = sim.now();
    sim.stall_firmware_until(stands + stall * kMs);
    sim.advance_to(stands + stall * kMs + 1);
    const bool dry = stall >= 7;
    EXPECT_EQ(sim.supervisor_state() == static_cast<int>(BoardState::fault), dry) << stall;
    if (dry) {  // long before the firmware is back
      EXPECT_LE(watch.safe_since, stands + 7 * kMs) << stall;
    }
    const auto receipt = board->wait(2s);
    ASSERT_OK(receipt);
    EXPECT_EQ(receipt->underruns, dry ? 1U : 0U);
    EXPECT_EQ(receipt->end, dry ? RunEnd::fault : RunEnd::completed);
    EXPECT_EQ(receipt->fault.has_value() && receipt->fault->name == "underrun", dry);
  }
}

constexpr std::array<std::uint64_t, 5> kBegins{
    0, (std::uint64_t{1} << 32U) - 5 * kMs, (std::uint64_t{1} << 63U) - 5 * kMs,
    UINT64_MAX - (std::uint64_t{1} << 40U), UINT64_MAX - (std::uint64_t{1} << 36U)};

/// The same run, wherever the board's clock stands.
TEST(Clock, running_over_changes_nothing) {
  std::vector<StepMark> first;
  for (const std::uint64_t begin : kBegins) {
    board_sim::SimBoardConfig config;
    config.start_tick = begin;
    board_sim::SimBoard sim(config);
    auto board = Board::connect(make_sim_link(sim), {.keep_alive = 20ms});
    ASSERT_OK(board);
    ASSERT_OK(board->configure(kLines));
    ProgramBuilder builder(board->info());
    builder.set("camera_trigger", true).loop(60).mark(1).pulse("lamp_enable", 200us).hold(300us).end_loop();
    const auto program = builder.end();
    ASSERT_OK(program);
    ASSERT_OK(board->upload(*program));
    ASSERT_OK(board->arm());
    ASSERT_OK(board->start_at({sim.now() + 2 * kMs}));
    auto receipt = board->wait(1s);
    ASSERT_OK(receipt);
    EXPECT_TRUE(receipt->clean()) << begin;
    EXPECT_GT(receipt->started.count, begin);
    for (StepMark& mark : receipt->marks) mark.tick = mark.tick - receipt->started;
    if (begin == 0) first = receipt->marks;
    EXPECT_EQ(receipt->marks, first) << begin;
    ASSERT_OK(board->set_line("lamp_enable", true));
    const std::uint64_t dies = sim.now();
    sim.advance_to(dies + 30 * kMs);
    EXPECT_EQ(sim.levels() & kOutputs, kSafe) << begin;
  }
}

/// Two crystals that disagree by 100 ppm: no keep-alive comes late, no run ends early, no tick moves.
TEST(Clock, drift_changes_nothing) {
  for (const int ppm : {-100, 0, 100}) {
    board_sim::SimBoard sim;
    auto board =
        Board::connect(std::make_unique<test::DriftingLink>(make_sim_link(sim), ppm), {.keep_alive = 30ms});
    ASSERT_OK(board);
    ASSERT_OK(board->configure(kLines));
    const auto receipt = board->run(blinking(board->info(), 50'000), 11s);
    ASSERT_OK(receipt);
    EXPECT_TRUE(receipt->clean()) << ppm;
    EXPECT_EQ(receipt->actual.count, 50'000U * 25'000U + 5) << ppm;  // the last word is held for min_dwell
    // The board's clock as the host sees it, over the ten seconds of the run: 100 ppm are a millisecond.
    const auto now = board->time();
    ASSERT_OK(now);
    const double board_s = static_cast<double>(now->taken.since.count) / 125e6;
    EXPECT_NEAR(seconds(now->received.since) / board_s, 1 + 1e-6 * ppm, 1e-6) << ppm;
  }
}

struct Limit {
  std::string rule;
  LineConfig line;
};

std::vector<Limit> limits() {
  return {{"max_on", {.line = "lamp_enable", .max_on = 1ms}},
          {"min_off", {.line = "lamp_enable", .min_off = 5ms}},
          {"duty", {.line = "lamp_enable", .max_duty = 0.25}}};
}

/// Two pulses of 2 ms, 2 ms apart: breaks each of the limits.
Program two_pulses(const BoardInfo& info) {
  ProgramBuilder builder(info);
  auto program = builder.pulse("lamp_enable", 2ms).hold(2ms).pulse("lamp_enable", 2ms).hold(1ms).end();
  EXPECT_TRUE(program.ok());
  return *std::move(program);
}

TEST(LimitsAlone, the_linter_without_a_board) {
  for (const Limit& limit : limits()) {
    const BoardInfo info = test::default_info();
    const std::vector<LineConfig> lines{limit.line};
    const auto findings = lint(two_pulses(info), info, lines);
    ASSERT_FALSE(findings.empty()) << limit.rule;
    for (const Finding& finding : findings) EXPECT_EQ(finding.rule, limit.rule);
  }
}

TEST(LimitsAlone, the_commit_without_the_linter) {
  for (const Limit& limit : limits()) {
    board_sim::SimBoard sim;
    auto board = Board::connect(make_sim_link(sim));
    ASSERT_OK(board);
    const std::vector<LineConfig> lines{limit.line};
    ASSERT_OK(board->configure(lines));
    const auto uploaded = board->upload(two_pulses(board->info()));
    ASSERT_FALSE(uploaded.ok()) << limit.rule;
    EXPECT_EQ(uploaded.error().code, ErrorCode::device_refused);
    EXPECT_NE(uploaded.error().line().find(limit.rule), std::string::npos) << uploaded.error().line();
    EXPECT_EQ(sim.supervisor_state(), static_cast<int>(BoardState::configured));
  }
}

/// Words fed to the engine behind the firmware's back, as if linter and commit had let them pass.
TEST(LimitsAlone, the_guard_without_linter_and_commit) {
  for (const Limit& limit : limits()) {
    board_sim::SimBoard sim;
    auto board = Board::connect(make_sim_link(sim));
    ASSERT_OK(board);
    const std::vector<LineConfig> lines{limit.line};
    ASSERT_OK(board->configure(lines));
    const std::uint64_t begin = sim.now();
    for (const std::uint32_t levels : {4U, 0U, 4U, 0U}) sim.force_segment(levels, 2 * kMs);
    // max_on: 1 ms after the first pulse began, the others when the second begins; the guard may be a tick
    // late.
    const std::uint64_t broken = begin + (limit.rule == "max_on" ? 1 : 4) * kMs;
    sim.advance_to(broken - 1);
    EXPECT_NE(sim.supervisor_state(), static_cast<int>(BoardState::fault)) << limit.rule;
    sim.advance_to(broken + 1);
    EXPECT_EQ(sim.levels() & kOutputs, 0U) << limit.rule;
    const auto status = board->status();
    ASSERT_OK(status);
    ASSERT_TRUE(status->fault.has_value()) << limit.rule;
    EXPECT_EQ(status->fault->name, limit.rule);
    sim.advance_to(begin + 20 * kMs);
    EXPECT_EQ(sim.levels() & kOutputs, 0U) << limit.rule;  // the rest is not played
  }
}

}  // namespace
}  // namespace symrig::faults_test
