// SPDX-License-Identifier: Apache-2.0
// A host that sends nothing: the board must be safe at most 10 ms after the keep-alive expired, by its own
// clock.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"

#include <array>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;
using protocol::raw;

constexpr std::uint32_t kTtlMs = 100;
constexpr Nanoseconds kTtl{100'000'000};
constexpr Nanoseconds kGrace{10'000'000};

Bytes endless(const BoardUnderTest& board) {
  const std::uint32_t bit = 1U << board.outputs().front();
  return pack({loop(1'000'000), word(bit, board.word()), end_loop(), end(bit)});
}

/// When the board accepted the keep-alive: between two readings of its clock.
struct Taken {
  std::uint64_t earliest = 0;
  std::uint64_t latest = 0;
};

Verdict speak_last(BoardUnderTest& board, Taken& taken) {
  taken.earliest = board.now();
  SYMRIG_MUST(code_is("keep_alive", symrig_wire_Code_CODE_OK, board.keep_alive(kTtlMs)));
  taken.latest = board.now();
  return {};
}

/// Sends nothing until the keep-alive expires, and then checks the fault.
Verdict lost(BoardUnderTest& board, const Taken& taken) {
  board.session.acknowledges = false;
  board.session.listen_for(kTtl + kGrace + kQuietTime);
  board.session.acknowledges = true;
  const auto now = board.status();
  if (!now) return failed("no answer to get_status");
  SYMRIG_MUST(same("state", symrig_wire_State_STATE_FAULT, raw(now->state)));
  SYMRIG_MUST(same("fault", symrig_wire_FaultCode_FAULT_KEEP_ALIVE, raw(now->fault.code)));
  SYMRIG_MUST(same("fault arg, the ttl in ms", kTtlMs, now->fault.arg));
  SYMRIG_MUST(within("tick of the fault", taken.earliest + board.ticks(kTtl),
                     taken.latest + board.ticks(kTtl + kGrace), now->fault.tick));
  return board.outputs_safe();
}

Verdict while_armed(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(endless(board)));
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  return lost(board, taken);
}

Verdict while_running(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(endless(board)));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  SYMRIG_MUST(lost(board, taken));
  SYMRIG_MUST(board.await_done(1s));
  return same("end of the run", symrig_wire_RunEnd_RUN_END_FAULT, raw(board.done().end));
}

Verdict by_hand(BoardUnderTest& board) {
  SYMRIG_MUST(board.configure());
  const std::uint32_t bit = 1U << board.outputs().front();
  SYMRIG_MUST(code_is("manual_set", symrig_wire_Code_CODE_OK, board.manual_set(bit, bit)));
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  return lost(board, taken);
}

/// No output is away from its safe level, so the board has no reason for a fault.
Verdict while_idle(BoardUnderTest& board) {
  SYMRIG_MUST(board.configure());
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  board.session.listen_for(kTtl + kGrace + kQuietTime);
  SYMRIG_MUST(board.in_state(symrig_wire_State_STATE_CONFIGURED));
  return board.outputs_safe();
}

Verdict kept_alive(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(endless(board)));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  for (int k = 0; k < 10; ++k) {
    SYMRIG_MUST(code_is("keep_alive", symrig_wire_Code_CODE_OK, board.keep_alive(kTtlMs)));
    board.session.listen_for(kTtl / 3);
  }
  return board.in_state(symrig_wire_State_STATE_RUNNING);
}

Verdict switched_off(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(endless(board)));
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("keep_alive 0", symrig_wire_Code_CODE_OK, board.keep_alive(0)));
  board.session.listen_for(kTtl + kGrace + kQuietTime);
  return board.in_state(symrig_wire_State_STATE_ARMED);
}

/// A run that was armed as autonomous continues without a host.
Verdict autonomous(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(endless(board)));
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  SYMRIG_MUST(code_is("arm, autonomous", symrig_wire_Code_CODE_OK, board.arm(true)));
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  board.session.listen_for(kTtl + kGrace + kQuietTime);
  return board.in_state(symrig_wire_State_STATE_RUNNING);
}

constexpr std::array<Check, 7> kHostLossChecks{{
    {"host_loss.while_armed", "armed: safe within the ttl and 10 ms", while_armed},
    {"host_loss.while_running", "running: safe within the ttl and 10 ms, and reports the end of the run",
     while_running},
    {"host_loss.by_hand", "levels by hand: safe within the ttl and 10 ms", by_hand},
    {"host_loss.while_idle", "idle: no fault", while_idle},
    {"host_loss.kept_alive", "the run continues while keep-alives arrive in time", kept_alive},
    {"host_loss.switched_off", "a keep-alive of 0 turns the monitoring off", switched_off},
    {"host_loss.autonomous", "an autonomous run continues without a host", autonomous},
}};

}  // namespace

std::span<const Check> host_loss_checks() {
  return kHostLossChecks;
}

}  // namespace symrig::conformance
