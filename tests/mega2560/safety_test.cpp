// SPDX-License-Identifier: Apache-2.0
// What makes the outputs safe: an interlock at any moment, an abort, a stopped processor; and what is kept
// over a reset.
#include "assert_ok.hpp"
#include "emulated_mega.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/internal/self_test_parts.hpp"

#include <algorithm>
#include <cstdio>

#include <gtest/gtest.h>

namespace symrig::test::mega_safety_test {
namespace {

using namespace std::chrono_literals;
constexpr unsigned kInterlock = 9;
constexpr unsigned kAux0 = 4;
constexpr unsigned kAux1 = 5;
constexpr std::uint64_t kMicrosecond = 16;  // cycles

const std::vector<LineConfig> kLines{{.line = "aux0"}, {.line = "interlock", .trip_level = true}};

/// The last moment at which an output was high, in cycles after `from`; 0: none was.
std::uint64_t high_after(EmulatedMega& mega, std::uint64_t from) {
  std::uint64_t last = 0;
  bool high = false;
  for (const MegaEdge& edge : mega.edges()) {
    if (edge.line != kAux0) continue;
    high = edge.level;
    if (edge.cycle > from) last = edge.cycle - from;
  }
  return high ? UINT64_MAX : last;
}

/// A configured board whose aux0 is high.
Result<Board> lit_board(EmulatedMega& mega) {
  SYMRIG_TRY(Board board, Board::connect(mega.link()));
  SYMRIG_CHECK(board.configure({}));
  SYMRIG_CHECK(board.set_line("aux0", true));
  EXPECT_TRUE(mega.output(kAux0));
  return board;
}

TEST(MegaSafety, an_interlock_stops_a_run_at_any_moment_of_a_word) {
  NEEDS_MEGA();
  std::uint64_t worst = 0;
  for (std::uint64_t phase = 0; phase < 640; phase += 32) {
    EmulatedMega mega;
    auto board = Board::connect(mega.link());
    ASSERT_OK(board);
    ASSERT_OK(board->configure(kLines));
    ProgramBuilder builder(board->info());
    builder.loop(100).set("aux0", true).hold(2ms).set("aux0", false).hold(3ms).end_loop();
    const auto program = builder.end();
    ASSERT_OK(program);
    ASSERT_OK(board->upload(*program));
    ASSERT_OK(board->arm());
    ASSERT_OK(board->start());
    mega.run(200'000 + phase * 3);
    for (int k = 0; k < 200'000 && !mega.output(kAux0); ++k) mega.run(1);
    ASSERT_TRUE(mega.output(kAux0));
    // Around the end of the word, where the engine's interrupt waits for the tick.
    mega.run(32'000 - 1'400 + phase * 2);
    const std::uint64_t opened = mega.cycle();
    mega.set_input(kInterlock, true);
    mega.run(20'000);
    const std::uint64_t took = high_after(mega, opened);
    ASSERT_LT(took, 60 * kMicrosecond) << "phase " << phase;
    worst = std::max(worst, took);
    const auto status = board->status();
    ASSERT_OK(status);
    EXPECT_EQ(status->state, BoardState::fault);
  }
  std::printf("interlock to safe: at most %.1f us\n", static_cast<double>(worst) / kMicrosecond);
}

/// The interlock opens at any moment of a manual set: while the request travels, is checked, and is answered.
TEST(MegaSafety, a_manual_set_never_survives_an_interlock) {
  NEEDS_MEGA();
  int accepted = 0;
  for (std::uint64_t when = 0; when < 160'000; when += 8'000) {
    EmulatedMega mega;
    auto board = Board::connect(mega.link());
    ASSERT_OK(board);
    ASSERT_OK(board->configure(kLines));
    mega.edges();
    const std::uint64_t opened = mega.cycle() + when;
    mega.set_input_at(opened, kInterlock, true);
    if (board->set_line("aux0", true)) ++accepted;
    mega.run(200'000);
    EXPECT_FALSE(mega.output(kAux0)) << "opened " << when << " cycles after the request";
    EXPECT_LT(high_after(mega, opened), 60 * kMicrosecond)
        << "opened " << when << " cycles after the request";
  }
  EXPECT_GT(accepted, 0) << "the sweep goes beyond the answer";
}

constexpr std::uint64_t kGlitch = 15 * kMicrosecond;

void open_for_a_moment(EmulatedMega& mega, std::uint64_t cycle) {
  mega.set_input_at(cycle, kInterlock, true);
  mega.set_input_at(cycle + kGlitch, kInterlock, false);
}

struct ManualSet {
  bool answered = false;
  bool on = false;         // outputs are on some time after the answer
  bool fault = false;      // and the board is in FAULT
  std::uint64_t rise = 0;  // when the output rose, in cycles after the request; 0: it did not
};

/// A manual set of aux1; with `lit`, aux0 is on before, so that the interlock is watched at every moment of
/// the request. The emulator does the same each time. opened: when the interlock opens for a moment, in
/// cycles after the request; 0: it does not.
ManualSet manual_set(bool lit, std::uint64_t opened) {
  EmulatedMega mega;
  ManualSet seen;
  auto board = Board::connect(mega.link());
  EXPECT_TRUE(board.ok() && board->configure(kLines).ok());
  EXPECT_TRUE(!lit || board->set_line("aux0", true).ok());
  mega.edges();
  const std::uint64_t asked = mega.cycle();
  if (opened != 0) open_for_a_moment(mega, asked + opened);
  seen.answered = board->set_line("aux1", true).ok();
  mega.run(32'000);
  seen.on = mega.output(kAux0) || mega.output(kAux1);
  for (const MegaEdge& edge : mega.edges())
    if (edge.line == kAux1 && edge.level) seen.rise = edge.cycle - asked;
  const auto status = board->status();
  EXPECT_TRUE(status.ok());
  seen.fault = status->state == BoardState::fault;
  return seen;
}

TEST(MegaSafety, an_opening_of_15_us_is_never_forgotten) {
  NEEDS_MEGA();
  const ManualSet plain = manual_set(true, 0);
  ASSERT_GT(plain.rise, 2'000U);
  std::vector<std::uint64_t> moments;
  for (std::uint64_t before = 1; before <= 120; before += 3)
    moments.push_back(plain.rise - before * kMicrosecond);
  for (std::uint64_t when = 9; when < 130'000; when += 20'003) moments.push_back(when);
  for (const std::uint64_t opened : moments) {
    const ManualSet seen = manual_set(true, opened);
    EXPECT_FALSE(seen.on) << "opened " << opened << " cycles after the request, the rise is at "
                          << plain.rise;
    EXPECT_TRUE(seen.fault) << "opened " << opened << " cycles after the request";
  }
}

TEST(MegaSafety, an_opening_of_15_us_just_before_the_outputs_rise_stops_them) {
  NEEDS_MEGA();
  const ManualSet plain = manual_set(false, 0);
  ASSERT_TRUE(plain.answered && plain.on);
  for (std::uint64_t before = 2; before <= 26; before += 3) {
    const ManualSet seen = manual_set(false, plain.rise - before * kMicrosecond);
    EXPECT_FALSE(seen.on) << "opened " << before << " us before the rise; answered " << seen.answered;
  }
}

TEST(MegaSafety, an_abort_works_while_the_board_is_busy) {
  NEEDS_MEGA();
  EmulatedMega mega;
  auto board = lit_board(mega);
  ASSERT_OK(board);
  ASSERT_OK(board->abort());
  EXPECT_FALSE(mega.output(kAux0));
}

TEST(MegaSafety, the_watchdog_restarts_a_processor_that_stands_still) {
  NEEDS_MEGA();
  EmulatedMega mega;
  ASSERT_OK(lit_board(mega));
  mega.stop_firmware();
  mega.run(16'000'000);
  EXPECT_FALSE(mega.output(kAux0));
  auto board = Board::connect(mega.link());
  ASSERT_OK(board);
  const auto status = board->status();
  ASSERT_OK(status);
  EXPECT_EQ(status->reset_cause, ResetCause::watchdog);
}

/// The keep-alive and the limits need the time. So the board restarts if its clock stands still.
TEST(MegaSafety, the_watchdog_restarts_a_board_whose_clock_stands_still) {
  NEEDS_MEGA();
  EmulatedMega mega;
  ASSERT_OK(lit_board(mega));
  mega.stop_clock();
  mega.run(std::uint64_t{16'000} * 320);  // an overflow of the clock, and the watchdog's 250 ms
  EXPECT_FALSE(mega.output(kAux0));
  auto board = Board::connect(mega.link());
  ASSERT_OK(board);
  const auto status = board->status();
  ASSERT_OK(status);
  EXPECT_EQ(status->reset_cause, ResetCause::watchdog);
}

TEST(MegaSafety, a_watchdog_that_is_starved_on_purpose_resets_the_board) {
  NEEDS_MEGA();
  EmulatedMega mega;
  auto board = lit_board(mega);
  ASSERT_OK(board);
  const auto test = board::test_watchdog(*board, {});
  ASSERT_OK(test);
  EXPECT_TRUE(test->passed) << test->text;
  ASSERT_TRUE(test->answered);
  const Nanoseconds answered = board->info().rate.nanoseconds(*test->answered);
  EXPECT_GE(answered, 200ms);
  EXPECT_LE(answered, 260ms);
  EXPECT_FALSE(mega.output(kAux0));
  std::printf("watchdog: %s\n", test->text.c_str());
}

TEST(MegaSafety, a_stored_configuration_holds_after_a_restart) {
  NEEDS_MEGA();
  EmulatedMega mega;
  std::uint32_t stored = 0;
  {
    auto board = Board::connect(mega.link());
    ASSERT_OK(board);
    ASSERT_OK(board->configure(std::vector<LineConfig>{{.line = "aux1", .safe_level = true}}));
    ASSERT_OK(board->store_config("bench 3"));
    stored = board->status()->stored_config;
    ASSERT_OK(board->reboot(false));
  }
  mega.run(16'000'000 / 4);
  EXPECT_TRUE(mega.output(5));
  auto board = Board::connect(mega.link());
  ASSERT_OK(board);
  EXPECT_EQ(board->info().label, "bench 3");
  const auto status = board->status();
  ASSERT_OK(status);
  EXPECT_EQ(status->reset_cause, ResetCause::request);
  EXPECT_EQ(status->stored_config, stored);
  EXPECT_NE(stored, 0U);
}

/// A laser with an active-low input would flash.
TEST(MegaSafety, a_line_that_is_safe_at_high_is_never_driven_low_by_a_restart) {
  NEEDS_MEGA();
  EmulatedMega mega;
  auto board = Board::connect(mega.link());
  ASSERT_OK(board);
  ASSERT_OK(board->configure(std::vector<LineConfig>{{.line = "aux1", .safe_level = true}}));
  ASSERT_OK(board->store_config("active low"));
  const auto restarts_by = [&](const char* what, ResetCause cause) {
    mega.run(16'000'000);
    EXPECT_TRUE(mega.output(kAux1)) << what;
    EXPECT_EQ(mega.take_driven_low() >> kAux1 & 1U, 0U) << what;
    const auto status = Board::connect(mega.link())->status();
    EXPECT_TRUE(status.ok()) << what;
    EXPECT_EQ(status->reset_cause, cause) << what;
  };
  mega.take_driven_low();
  mega.reset_by_pin();
  restarts_by("reset by pin", ResetCause::pin);
  mega.stop_firmware();
  restarts_by("reset by watchdog", ResetCause::watchdog);
  board = Board::connect(mega.link());
  ASSERT_OK(board);
  ASSERT_OK(board->reboot(false));
  restarts_by("reset by request", ResetCause::request);
}

}  // namespace
}  // namespace symrig::test::mega_safety_test
