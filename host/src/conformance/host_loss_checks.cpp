// SPDX-License-Identifier: Apache-2.0
// A host that falls silent: safe at the latest 10 ms after the keep-alive has run out, by the board's own
// clock.
#include "conformance/plan.hpp"
#include "conformance/subject.hpp"

#include <array>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;
using protocol::raw;

constexpr std::uint32_t kTtlMs = 100;
constexpr Nanoseconds kTtl{100'000'000};
constexpr Nanoseconds kGrace{10'000'000};

Bytes endless(const Subject& board) {
  const std::uint32_t bit = 1U << board.outputs().front();
  return pack({loop(1'000'000), word(bit, board.word()), end_loop(), end(bit)});
}

/// When the keep-alive was taken: between two readings of the board's clock.
struct Taken {
  std::uint64_t earliest = 0;
  std::uint64_t latest = 0;
};

Verdict speak_last(Subject& board, Taken& taken) {
  taken.earliest = board.now();
  SYMRIG_MUST(code_is("keep_alive", symrig_wire_Code_CODE_OK, board.keep_alive(kTtlMs)));
  taken.latest = board.now();
  return {};
}

/// Silence; then what the board says about it.
Verdict lost(Subject& board, const Taken& taken) {
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

Verdict while_armed(Subject& board) {
  SYMRIG_MUST(board.load(endless(board)));
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  return lost(board, taken);
}

Verdict while_running(Subject& board) {
  SYMRIG_MUST(board.load(endless(board)));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  SYMRIG_MUST(lost(board, taken));
  SYMRIG_MUST(board.await_done(1s));
  return same("end of the run", symrig_wire_RunEnd_RUN_END_FAULT, raw(board.done().end));
}

Verdict by_hand(Subject& board) {
  SYMRIG_MUST(board.configure());
  const std::uint32_t bit = 1U << board.outputs().front();
  SYMRIG_MUST(code_is("manual_set", symrig_wire_Code_CODE_OK, board.manual_set(bit, bit)));
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  return lost(board, taken);
}

/// Nothing moves, nothing stands where it should not: no fault.
Verdict while_idle(Subject& board) {
  SYMRIG_MUST(board.configure());
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  board.session.listen_for(kTtl + kGrace + kQuietTime);
  SYMRIG_MUST(board.in_state(symrig_wire_State_STATE_CONFIGURED));
  return board.outputs_safe();
}

Verdict kept_alive(Subject& board) {
  SYMRIG_MUST(board.load(endless(board)));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  for (int k = 0; k < 10; ++k) {
    SYMRIG_MUST(code_is("keep_alive", symrig_wire_Code_CODE_OK, board.keep_alive(kTtlMs)));
    board.session.listen_for(kTtl / 3);
  }
  return board.in_state(symrig_wire_State_STATE_RUNNING);
}

Verdict switched_off(Subject& board) {
  SYMRIG_MUST(board.load(endless(board)));
  Taken taken;
  SYMRIG_MUST(speak_last(board, taken));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  SYMRIG_MUST(code_is("keep_alive 0", symrig_wire_Code_CODE_OK, board.keep_alive(0)));
  board.session.listen_for(kTtl + kGrace + kQuietTime);
  return board.in_state(symrig_wire_State_STATE_ARMED);
}

/// Armed to go on without a host, and so it does.
Verdict autonomous(Subject& board) {
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
    {"host_loss.while_running", "running: safe within the ttl and 10 ms, and the run's end is told",
     while_running},
    {"host_loss.by_hand", "levels by hand: safe within the ttl and 10 ms", by_hand},
    {"host_loss.while_idle", "at rest: no fault", while_idle},
    {"host_loss.kept_alive", "a host that speaks in time keeps the run going", kept_alive},
    {"host_loss.switched_off", "a keep-alive of 0 ends the watch", switched_off},
    {"host_loss.autonomous", "an autonomous run goes on", autonomous},
}};

}  // namespace

std::span<const Check> host_loss_checks() {
  return kHostLossChecks;
}

}  // namespace symrig::conformance
