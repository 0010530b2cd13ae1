// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "conformance/check.hpp"
#include "conformance/raw_session.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace symrig::conformance {

/// The board under test: its identity and abilities, and functions that bring it into each state.
class BoardUnderTest {
 public:
  explicit BoardUnderTest(std::unique_ptr<Link> link) : session(std::move(link)) {}

  RawSession session;
  symrig_wire_HelloReply who = symrig_wire_HelloReply_init_zero;
  symrig_wire_CapabilitiesReply can = symrig_wire_CapabilitiesReply_init_zero;
  std::vector<symrig_wire_LineReply> lines;
  /// Numbers of the output and the input that the jumper connects.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> jumper;

  /// Requests hello, capabilities and lines. If this fails, no check is possible.
  Verdict meet();
  /// Begins a new session, and removes fault, configuration, keep-alive and pending events.
  Verdict start_afresh();
  /// Aborts, and leaves the board without a configuration and with safe outputs.
  void leave_safe();

  // Properties of the board.
  std::vector<std::uint32_t> outputs() const;
  std::vector<std::uint32_t> inputs() const;
  /// The first output with time-stamps. None: the board cannot guard limits.
  std::optional<std::uint32_t> seen_output() const;
  std::uint64_t ticks(Nanoseconds time) const { return TickRate{can.tick_hz}.ticks(time).count; }
  /// Software makes its edges: a word may go out late, and the board then counts it.
  bool best_effort() const { return can.lateness != 0; }
  /// A word that the board can repeat for ever: 200 us, or longer if its edge engine needs it (rule refill).
  std::uint32_t word() const;
  protocol::ProgramRules rules() const;

  // Requests. They return the code of the reply.
  std::uint32_t code(pb_size_t which) { return session.code(make_request(which)); }
  std::uint32_t config_line(std::uint32_t line);
  std::uint32_t finalize();
  std::uint32_t program_begin(std::uint32_t length);
  std::uint32_t commit(std::uint32_t crc);
  std::uint32_t arm(bool autonomous = false);
  std::uint32_t start() { return code(symrig_wire_Request_start_tag); }
  std::uint32_t start_at(std::uint64_t tick);
  std::uint32_t keep_alive(std::uint32_t ttl_ms);
  std::uint32_t manual_set(std::uint32_t mask, std::uint32_t levels);
  std::uint32_t clear_fault(std::uint32_t fault);
  void abort() { session.ask_urgently(make_request(symrig_wire_Request_abort_tag)); }
  std::optional<symrig_wire_StatusReply> status();
  std::optional<symrig_wire_TimeReply> time();
  std::uint64_t now();  ///< the board's tick; 0 if it does not answer

  // Sequences of requests. A failed verdict names the request that failed.
  /// Sets `config`: every line, without limits, with low safe levels.
  void plain_config();
  Verdict configure();
  /// Sends program_begin and all chunks.
  Verdict send_program(const Bytes& program);
  Verdict upload(const Bytes& program);
  Verdict load(const Bytes& program);
  Verdict run_to_end(const Bytes& program, Nanoseconds timeout);
  Verdict await_done(Nanoseconds timeout);
  Verdict in_state(symrig_wire_State state);
  /// Passes if all outputs are at the safe levels of `config`.
  Verdict outputs_safe();
  const symrig_wire_RunDone& done() const;
  /// What the last run tells of late words. Hardware makes none. A best-effort board counts them: at least
  /// `seen`, those that edges have shown, and no more than it has put out.
  Verdict late_as_told(std::size_t seen = 0) const;
  /// A best-effort board has stopped by itself because a word's whole time had gone by: the machine was busy.
  bool underran();

  /// The configuration that configure() sends.
  protocol::BoardConfig config;
  std::uint32_t program_id = 1;
  std::uint32_t program_hash = 0;
  std::uint32_t config_hash = 0;
  symrig_wire_CommitReply committed = symrig_wire_CommitReply_init_zero;
};

}  // namespace symrig::conformance
