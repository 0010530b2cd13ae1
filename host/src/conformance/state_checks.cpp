// SPDX-License-Identifier: Apache-2.0
// The table of protocol/PROTOCOL.md: every request in every state that a host can reach. A refused request
// has its code and changes nothing. An allowed one leads to the state in the table.
// A host that sends nothing: the board must be safe at most 10 ms after the keep-alive expired, by its own
// clock.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"

#include <array>

#include <fmt/format.h>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;
using protocol::raw;

constexpr int kNo = -1;     // refused: bad_state
constexpr int kLeave = -2;  // not tested here

struct Row {
  std::string_view name;
  pb_size_t request;
  std::array<int, 8> next;  // by state: the state after it
};

constexpr int kS = symrig_wire_State_STATE_SAFE;
constexpr int kC = symrig_wire_State_STATE_CONFIGURED;
constexpr int kL = symrig_wire_State_STATE_LOADED;
constexpr int kA = symrig_wire_State_STATE_ARMED;
constexpr int kR = symrig_wire_State_STATE_RUNNING;
constexpr int kD = symrig_wire_State_STATE_DONE;
constexpr int kF = symrig_wire_State_STATE_FAULT;

// store_config and reboot are tested only where the board must refuse them: flash wears, and a restart ends
// the session.
// clang-format off
constexpr std::array<Row, 20> kTable{{
    // boot, safe, configured, loaded, armed, running, done, fault
    {"hello", symrig_wire_Request_hello_tag,
     {kLeave, kS, kC, kL, kA, kR, kD, kF}},
    {"capabilities", symrig_wire_Request_capabilities_tag,
     {kLeave, kS, kC, kL, kA, kR, kD, kF}},
    {"get_status", symrig_wire_Request_get_status_tag,
     {kLeave, kS, kC, kL, kA, kR, kD, kF}},
    {"time_ping", symrig_wire_Request_time_ping_tag,
     {kLeave, kS, kC, kL, kA, kR, kD, kF}},
    {"identify", symrig_wire_Request_identify_tag,
     {kLeave, kS, kC, kL, kA, kR, kD, kF}},
    {"keep_alive", symrig_wire_Request_keep_alive_tag,
     {kLeave, kS, kC, kL, kA, kR, kD, kF}},
    {"reset_config", symrig_wire_Request_reset_config_tag,
     {kLeave, kS, kS, kS, kNo, kNo, kS, kNo}},
    {"config_line", symrig_wire_Request_config_line_tag,
     {kLeave, kS, kS, kS, kNo, kNo, kS, kNo}},
    {"finalize_config", symrig_wire_Request_finalize_config_tag,
     {kLeave, kC, kNo, kNo, kNo, kNo, kNo, kNo}},
    {"program_begin", symrig_wire_Request_program_begin_tag,
     {kLeave, kNo, kC, kC, kNo, kNo, kC, kNo}},
    {"program_commit", symrig_wire_Request_program_commit_tag,
     {kLeave, kNo, kLeave, kNo, kNo, kNo, kNo, kNo}},
    {"program_verify", symrig_wire_Request_program_verify_tag,
     {kLeave, kNo, kNo, kL, kNo, kNo, kD, kNo}},
    {"program_line", symrig_wire_Request_program_line_tag,
     {kLeave, kNo, kNo, kL, kA, kR, kD, kLeave}},
    {"arm", symrig_wire_Request_arm_tag,
     {kLeave, kNo, kNo, kA, kNo, kNo, kA, kNo}},
    {"start", symrig_wire_Request_start_tag,
     {kLeave, kNo, kNo, kNo, kR, kNo, kNo, kNo}},
    {"abort", symrig_wire_Request_abort_tag,
     {kLeave, kS, kC, kL, kL, kL, kL, kF}},
    {"clear_fault", symrig_wire_Request_clear_fault_tag,
     {kLeave, kNo, kNo, kNo, kNo, kNo, kNo, kS}},
    {"manual_set", symrig_wire_Request_manual_set_tag,
     {kLeave, kNo, kC, kL, kNo, kNo, kL, kNo}},
    {"store_config", symrig_wire_Request_store_config_tag,
     {kLeave, kNo, kLeave, kLeave, kNo, kNo, kLeave, kNo}},
    {"reboot", symrig_wire_Request_reboot_tag,
     {kLeave, kLeave, kLeave, kLeave, kNo, kNo, kLeave, kLeave}},
}};
// clang-format on

/// Runs for two seconds, longer than all requests of the table.
Bytes long_program(const BoardUnderTest& board) {
  const std::uint64_t rounds = board.ticks(2s) / board.word() + 1;
  return pack({loop(rounds), word(1U << board.outputs().front(), board.word()), end_loop(), end()});
}

Verdict enter_fault(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(long_program(board)));
  SYMRIG_MUST(code_is("keep_alive 20", symrig_wire_Code_CODE_OK, board.keep_alive(20)));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  board.session.listen_for(60ms);
  return {};
}

Verdict enter_done(BoardUnderTest& board) {
  return board.run_to_end(pack({word(1U << board.outputs().front(), board.word()), end()}), 1s);
}

Verdict enter(BoardUnderTest& board, int state) {
  SYMRIG_MUST(board.start_afresh());
  if (state == kF) SYMRIG_MUST(enter_fault(board));
  if (state == kD) SYMRIG_MUST(enter_done(board));
  if (state == kC) SYMRIG_MUST(board.configure());
  if (state == kL || state == kA || state == kR) SYMRIG_MUST(board.load(long_program(board)));
  if (state == kA || state == kR) SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  if (state == kR) SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  return board.in_state(static_cast<symrig_wire_State>(state));
}

/// A request with valid arguments, which succeeds in a state where it is allowed.
symrig_wire_Request sensible(BoardUnderTest& board, pb_size_t which) {
  symrig_wire_Request request = make_request(which);
  const std::uint32_t output = board.outputs().front();
  switch (which) {
    case symrig_wire_Request_config_line_tag:
      request.body.config_line.line = output;
      request.body.config_line.direction = symrig_wire_Direction_DIRECTION_OUTPUT;
      break;
    case symrig_wire_Request_finalize_config_tag:
      request.body.finalize_config.hash = protocol::config_hash({});
      break;
    case symrig_wire_Request_program_begin_tag:
      request.body.program_begin = {1, 8};
      break;
    case symrig_wire_Request_program_line_tag:
      request.body.program_line.line = output;
      break;
    case symrig_wire_Request_arm_tag:
      request.body.arm = {board.program_hash, board.config_hash, false};
      break;
    case symrig_wire_Request_clear_fault_tag:
      request.body.clear_fault.code = symrig_wire_FaultCode_FAULT_KEEP_ALIVE;
      break;
    case symrig_wire_Request_reboot_tag:
      request.body.reboot.token = protocol::crc32c({board.who.unique_id.bytes, board.who.unique_id.size});
      break;
    default:
      break;
  }
  return request;
}

Verdict refuses(BoardUnderTest& board, const Row& row, int state) {
  const auto reply = board.session.ask(sensible(board, row.request));
  SYMRIG_MUST(code_is(row.name, symrig_wire_Code_CODE_BAD_STATE, reply ? raw(reply->code) : kNoCode));
  SYMRIG_MUST(same(fmt::format("{}: detail", row.name), static_cast<std::uint64_t>(state), reply->detail));
  return board.in_state(static_cast<symrig_wire_State>(state));
}

Verdict allows(BoardUnderTest& board, const Row& row, int next) {
  SYMRIG_MUST(code_is(row.name, symrig_wire_Code_CODE_OK, board.session.code(sensible(board, row.request))));
  const auto now = board.status();
  if (!now) return failed("no answer to get_status");
  SYMRIG_MUST(
      same(fmt::format("state after {}", row.name), static_cast<std::uint64_t>(next), raw(now->state)));
  const bool safe = next == kS || next == kF || row.request == symrig_wire_Request_abort_tag;
  return safe ? board.outputs_safe() : Verdict{};
}

template <int State>
Verdict walk(BoardUnderTest& board) {
  SYMRIG_MUST(enter(board, State));
  for (const Row& row : kTable) {
    const int next = row.next.at(static_cast<std::size_t>(State));
    if (next == kLeave) continue;
    if (next == kNo) {
      SYMRIG_MUST(refuses(board, row, State));
    } else {
      SYMRIG_MUST(allows(board, row, next));
      SYMRIG_MUST(enter(board, State));
    }
  }
  return {};
}

Verdict wrong_fault(BoardUnderTest& board) {
  SYMRIG_MUST(enter(board, kF));
  symrig_wire_Request request = make_request(symrig_wire_Request_clear_fault_tag);
  request.body.clear_fault.code = symrig_wire_FaultCode_FAULT_MAX_ON;
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(code_is("clear_fault of another fault", symrig_wire_Code_CODE_BAD_VALUE,
                      reply ? raw(reply->code) : kNoCode));
  SYMRIG_MUST(same("detail", symrig_wire_FaultCode_FAULT_KEEP_ALIVE, reply->detail));
  return board.in_state(symrig_wire_State_STATE_FAULT);
}

Verdict arm_hashes(BoardUnderTest& board) {
  SYMRIG_MUST(enter(board, kL));
  const std::uint32_t program = board.program_hash;
  board.program_hash ^= 1U;
  SYMRIG_MUST(code_is("arm with another program's hash", symrig_wire_Code_CODE_HASH_MISMATCH, board.arm()));
  board.program_hash = program;
  board.config_hash ^= 1U;
  SYMRIG_MUST(
      code_is("arm with another configuration's hash", symrig_wire_Code_CODE_HASH_MISMATCH, board.arm()));
  return board.in_state(symrig_wire_State_STATE_LOADED);
}

constexpr std::array<Check, 9> kStateChecks{{
    {"states.safe", "every request in SAFE", walk<kS>},
    {"states.configured", "every request in CONFIGURED", walk<kC>},
    {"states.loaded", "every request in LOADED", walk<kL>},
    {"states.armed", "every request in ARMED", walk<kA>},
    {"states.running", "every request in RUNNING", walk<kR>},
    {"states.done", "every request in DONE", walk<kD>},
    {"states.fault", "every request in FAULT", walk<kF>},
    {"states.wrong_fault", "clear_fault clears only the latched fault", wrong_fault},
    {"states.arm_hashes", "arm needs both hashes", arm_hashes},
}};

}  // namespace

std::span<const Check> state_checks() {
  return kStateChecks;
}

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
