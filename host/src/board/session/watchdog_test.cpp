// SPDX-License-Identifier: Apache-2.0
#include "board/session/watchdog_test.hpp"

#include "board/session/names.hpp"
#include "symrig/base/time.hpp"

#include <thread>
#include <utility>

#include <fmt/format.h>

namespace symrig::board {
namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kLook = 10ms;
constexpr Nanoseconds kPatience = 1s;  // twice what a watchdog may take (hal/watchdog.hpp)
constexpr Nanoseconds kAllowed = 500ms;
constexpr Nanoseconds kLeaving = 100ms;  // a board restarts 20 ms after its answer
constexpr double kReturnSeconds = 10;
constexpr int kReturnTries = 40;  // also in virtual time, where seconds of this machine say nothing

/// For how long the board still answers; none: it does not stop within kPatience.
Result<std::optional<Ticks>> answers_for(Board& board) {
  SYMRIG_TRY(const BoardStatus first, board.status());
  const Ticks most = board.info().rate.ticks(kPatience);
  Ticks answered{0};
  while (answered.count < most.count) {
    if (!board.idle(kLook)) return std::optional(answered);
    const auto now = board.status();
    if (!now) return std::optional(answered);
    answered = {now->now.count - first.now.count};
  }
  return std::optional<Ticks>();
}

/// A new session with the same board: over the old link, or over a new one if that has ended.
Result<void> meet_again(Board& board, const Reconnect& reconnect) {
  if (board.rejoin()) return {};
  if (!reconnect) return Error{ErrorCode::device_lost, "its link has ended", ""};
  SYMRIG_TRY(auto again, reconnect());
  board = std::move(again);
  return {};
}

Result<void> wait_for_return(Board& board, const Reconnect& reconnect) {
  const std::string who = board.info().unique_id;
  const Stopwatch watch;
  for (int tries = 0; tries < kReturnTries || watch.seconds() < kReturnSeconds; ++tries) {
    if (!board.idle(kLook)) std::this_thread::sleep_for(kLook);
    if (meet_again(board, reconnect) && board.info().unique_id == who) return {};
  }
  return Error{ErrorCode::device_lost, fmt::format("board {} did not come back after its reset", who),
               "look at its light, then plug it in again"};
}

Result<ResetCause> cause_after_request(Board& board, const Reconnect& reconnect) {
  SYMRIG_CHECK(board.reboot(false));
  static_cast<void>(board.idle(kLeaving));  // the link may end here
  SYMRIG_CHECK(wait_for_return(board, reconnect));
  SYMRIG_TRY(const BoardStatus status, board.status());
  return status.reset_cause;
}

}  // namespace

Result<WatchdogTest> test_watchdog(Board& board, const Reconnect& reconnect) {
  WatchdogTest found;
  SYMRIG_CHECK(board.starve_watchdog());
  SYMRIG_TRY(found.answered, answers_for(board));
  if (!found.answered) {
    found.text = fmt::format("the board still answers {} s after its last feed: nothing resets it",
                             std::chrono::duration<double>(kPatience).count());
    return found;
  }
  SYMRIG_CHECK(wait_for_return(board, reconnect));
  SYMRIG_TRY(const BoardStatus status, board.status());
  found.cause = status.reset_cause;
  const std::string time = ticks_text(board.info(), found.answered->count);
  const bool in_time = found.answered->count <= board.info().rate.ticks(kAllowed).count;
  SYMRIG_TRY(const ResetCause later, cause_after_request(board, reconnect));
  found.passed = in_time && found.cause == ResetCause::watchdog && status.state == BoardState::safe &&
                 later == ResetCause::request;
  found.text = fmt::format("without feeds it answered for {}, then started by {}; after a request by {}",
                           time, name(*found.cause), name(later));
  return found;
}

}  // namespace symrig::board
