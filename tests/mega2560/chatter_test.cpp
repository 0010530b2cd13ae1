// SPDX-License-Identifier: Apache-2.0
// An input that changes much faster than the processor can follow: every protection must work as if it were
// still.
#include "assert_ok.hpp"
#include "emulated_mega.hpp"
#include "symrig/board/board.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>

#include <gtest/gtest.h>

namespace symrig::test::mega_chatter_test {
namespace {

using namespace std::chrono_literals;
constexpr unsigned kLamp = 2;
constexpr unsigned kFirstInput = 6;
constexpr unsigned kInterlock = 9;
constexpr std::uint64_t kMicrosecond = 16;  // cycles
constexpr std::uint64_t kMillisecond = 1000 * kMicrosecond;
constexpr std::uint64_t kToSafe = 60 * kMicrosecond;  // what docs/board-mega2560.md promises
// Cycles from edge to edge: 1 kHz to 1 MHz. 2,750 is just what the board takes.
constexpr std::uint64_t kPeriods[] = {16'000, 4'000, 2'750, 2'400, 1'600, 800, 400, 203, 160, 64, 33, 16};
constexpr std::uint64_t kFewPeriods[] = {2'750, 400, 16};
const std::vector<unsigned> kAllOthers{6, 7, 8, 10, 11};  // all inputs but the interlock

void shake(EmulatedMega& mega, const std::vector<unsigned>& lines, std::uint64_t period) {
  for (const unsigned line : lines) mega.chatter(line, period);
}

/// When the lamp went off for good, in cycles after `from`. No value: it is on.
std::optional<std::uint64_t> off_after(EmulatedMega& mega, std::uint64_t from) {
  std::uint64_t last = 0;
  for (const MegaEdge& edge : mega.edges())
    if (edge.line == kLamp && edge.cycle > from) last = edge.cycle - from;
  if (mega.output(kLamp)) return std::nullopt;
  return last;
}

/// A board whose lamp is on. An interlock is there, and the host must send a keep-alive each 300 ms.
Result<Board> lit_board(EmulatedMega& mega, Nanoseconds max_on, bool with_vsync = false) {
  SYMRIG_TRY(Board board, Board::connect(mega.link()));
  std::vector<LineConfig> lines{{.line = "lamp_enable", .hazard = Hazard::lamp, .max_on = max_on},
                                {.line = "interlock", .trip_level = true}};
  if (with_vsync) lines.push_back({.line = "vsync"});
  SYMRIG_CHECK(board.configure(lines));
  SYMRIG_CHECK(board.keep_alive(300ms));
  SYMRIG_CHECK(board.set_line("lamp_enable", true));
  return board;
}

/// The lamp is on in a run that has a word each two milliseconds.
void run_busily(Board& board) {
  ProgramBuilder builder(board.info());
  builder.set("lamp_enable", true)
      .loop(90)
      .set("aux0", true)
      .hold(2ms)
      .set("aux0", false)
      .hold(2ms)
      .end_loop();
  const auto program = builder.set("lamp_enable", false).hold(1ms).end();
  ASSERT_OK(program);
  ASSERT_OK(board.upload(*program));
  ASSERT_OK(board.keep_alive(300ms));
  ASSERT_OK(board.arm());
  ASSERT_OK(board.start());
}

/// The interlock opens `after` cycles of chatter. Returns how long the lamp was on after that; no value: the
/// chatter itself had stopped it before.
std::optional<std::uint64_t> opened_under(const std::vector<unsigned>& lines, std::uint64_t period,
                                          std::uint64_t after, bool in_a_run) {
  EmulatedMega mega;
  auto board = lit_board(mega, 2s);
  EXPECT_TRUE(board.ok());
  if (in_a_run) run_busily(*board);
  shake(mega, lines, period);
  mega.run(after);
  const bool lit = mega.output(kLamp);
  const std::uint64_t opened = mega.cycle();
  mega.set_input(kInterlock, true);
  mega.run(5 * kMillisecond);
  const auto took = off_after(mega, opened);
  EXPECT_TRUE(took) << "the lamp is still on";
  const auto status = board->status();
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(status->state, BoardState::fault);
  if (!lit) return std::nullopt;
  EXPECT_EQ(status->fault->name, "interlock");
  return took.value_or(UINT64_MAX);
}

TEST(MegaChatter, an_interlock_stops_the_outputs_while_other_inputs_chatter) {
  NEEDS_MEGA();
  std::uint64_t worst = 0;
  unsigned lit = 0;
  const auto open_at = [&](const std::vector<unsigned>& lines, std::uint64_t period, std::uint64_t after,
                           bool in_a_run) {
    const auto took = opened_under(lines, period, after, in_a_run);
    if (!took) return;
    ++lit;
    EXPECT_LT(*took, kToSafe) << lines.size() << " inputs from " << lines.front() << ", edges each " << period
                              << ", opened after " << after;
    worst = std::max(worst, *took);
  };
  for (const std::uint64_t period : kPeriods) {
    open_at(kAllOthers, period, 3 * period + 61, false);
    open_at(kAllOthers, period, 5 * period + 7 * kMicrosecond, true);
    open_at(kAllOthers, period, 6 * period + 211, true);
  }
  for (const unsigned line : kAllOthers)
    for (const std::uint64_t period : kFewPeriods) open_at({line}, period, 6 * period + 61, line % 2 == 0);
  EXPECT_GT(lit, 40U) << "of 51 moments";
  std::printf("interlock to safe under chatter: at most %.1f us (%u moments)\n",
              static_cast<double>(worst) / kMicrosecond, lit);
}

TEST(MegaChatter, an_interlock_that_chatters_itself_stops_the_outputs_at_its_first_edge) {
  NEEDS_MEGA();
  std::uint64_t worst = 0;
  for (const std::uint64_t period : kPeriods) {
    EmulatedMega mega;
    auto board = lit_board(mega, 2s);
    ASSERT_OK(board);
    mega.chatter(kInterlock, period);
    const std::uint64_t first = mega.cycle() + period;
    mega.run(period + 5 * kMillisecond);
    const auto took = off_after(mega, first);
    ASSERT_TRUE(took) << "edges each " << period;
    EXPECT_LT(*took, kToSafe) << "edges each " << period;
    worst = std::max(worst, *took);
    const auto status = board->status();
    ASSERT_OK(status);
    EXPECT_EQ(status->state, BoardState::fault);
    ASSERT_TRUE(status->fault);
    EXPECT_EQ(status->fault->name, "interlock");
  }
  std::printf("a chattering interlock to safe: at most %.1f us\n", static_cast<double>(worst) / kMicrosecond);
}

/// The host is silent from now on, and the lamp has a limit: the earlier of both makes the outputs safe.
std::uint64_t lit_for(const std::vector<unsigned>& lines, std::uint64_t period, Nanoseconds max_on) {
  EmulatedMega mega;
  auto board = lit_board(mega, max_on);
  EXPECT_TRUE(board.ok());
  const std::uint64_t lit = mega.cycle();
  shake(mega, lines, period);
  mega.run(400 * kMillisecond);
  return off_after(mega, lit).value_or(UINT64_MAX);
}

TEST(MegaChatter, a_silent_host_and_a_limit_still_stop_the_lamp) {
  NEEDS_MEGA();
  std::uint64_t silent = 0;
  std::uint64_t limit = 0;
  const auto stops = [&](const std::vector<unsigned>& lines, std::uint64_t period) {
    silent = std::max(silent, lit_for(lines, period, 2s));
    EXPECT_LT(silent, 310 * kMillisecond) << lines.size() << " inputs, edges each " << period;
    limit = std::max(limit, lit_for(lines, period, 100ms));
    EXPECT_LT(limit, 110 * kMillisecond) << lines.size() << " inputs, edges each " << period;
  };
  for (const std::uint64_t period : kPeriods) stops(kAllOthers, period);
  for (const std::uint64_t period : kFewPeriods) stops({kFirstInput}, period);
  std::printf("under chatter: keep-alive of 300 ms acts after %.1f ms, max_on of 100 ms after %.1f ms\n",
              static_cast<double>(silent) / kMillisecond, static_cast<double>(limit) / kMillisecond);
}

TEST(MegaChatter, an_abort_still_stops_the_lamp) {
  NEEDS_MEGA();
  std::uint64_t worst = 0;
  for (const std::uint64_t period : kPeriods) {
    EmulatedMega mega;
    auto board = lit_board(mega, 2s);
    ASSERT_OK(board);
    shake(mega, kAllOthers, period);
    mega.run(3 * kMillisecond + period);
    const std::uint64_t sent = mega.cycle();
    ASSERT_OK(board->abort());
    const auto took = off_after(mega, sent);
    ASSERT_TRUE(took);
    worst = std::max(worst, *took);
    // 17 bytes of 100 us each, and the interrupt of the last one.
    EXPECT_LT(*took, 1'900 * kMicrosecond) << "edges each " << period;
  }
  std::printf("abort to safe under chatter: at most %.1f us, of which the bytes take 1,600\n",
              static_cast<double>(worst) / kMicrosecond);
}

TEST(MegaChatter, an_input_that_the_run_needs_is_a_fault_that_names_it) {
  NEEDS_MEGA();
  for (const std::uint64_t period : {1'200U, 800U, 400U, 160U, 16U}) {
    EmulatedMega mega;
    auto board = lit_board(mega, 2s, true);
    ASSERT_OK(board);
    mega.chatter(kFirstInput, period);
    mega.run(20 * kMillisecond);
    EXPECT_FALSE(mega.output(kLamp)) << "edges each " << period;
    const auto status = board->status();
    ASSERT_OK(status);
    ASSERT_TRUE(status->fault) << "edges each " << period;
    EXPECT_EQ(status->fault->name, "chatter");
    EXPECT_EQ(status->fault->arg, kFirstInput);
  }
}

TEST(MegaChatter, an_input_that_chatters_before_the_lamp_is_on_stops_it_too) {
  NEEDS_MEGA();
  for (const std::uint64_t period : {800U, 400U, 16U}) {
    EmulatedMega mega;
    mega.chatter(kFirstInput, period);
    mega.run(50 * kMillisecond);
    auto board = lit_board(mega, 2s, true);
    ASSERT_OK(board);
    mega.run(20 * kMillisecond);
    EXPECT_FALSE(mega.output(kLamp)) << "edges each " << period;
    const auto status = board->status();
    ASSERT_OK(status);
    ASSERT_TRUE(status->fault) << "edges each " << period;
    EXPECT_EQ(status->fault->name, "chatter");
  }
}

TEST(MegaChatter, an_input_of_two_kilohertz_is_taken) {
  NEEDS_MEGA();
  EmulatedMega mega;
  auto board = lit_board(mega, 2s, true);
  ASSERT_OK(board);
  mega.chatter(kFirstInput, 4'000);
  mega.run(200 * kMillisecond);
  EXPECT_TRUE(mega.output(kLamp));
}

}  // namespace
}  // namespace symrig::test::mega_chatter_test
