// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "conformance/check.hpp"
#include "conformance/raw_session.hpp"
#include "symrig/board/ticks.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program_rules.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace symrig::conformance {

/// The board under test: what it says of itself, and the ways into each of its states.
class Subject {
 public:
  explicit Subject(std::unique_ptr<Link> link) : session(std::move(link)) {}

  RawSession session;
  symrig_wire_HelloReply who = symrig_wire_HelloReply_init_zero;
  symrig_wire_CapabilitiesReply can = symrig_wire_CapabilitiesReply_init_zero;
  std::vector<symrig_wire_LineReply> lines;
  /// Lines by number.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> jumper;

  /// Hello, capabilities, lines. A failed verdict: there is nothing to test.
  Verdict meet();
  /// A new session, no fault, no configuration, no keep-alive, nothing half-done.
  Verdict start_afresh();
  /// Leaves the board as nobody could be hurt by it.
  void leave_safe();

  // What the board has.
  std::vector<std::uint32_t> outputs() const;
  std::vector<std::uint32_t> inputs() const;
  /// First output whose edges the board sees; none: limits cannot be watched.
  std::optional<std::uint32_t> seen_output() const;
  std::uint64_t ticks(Nanoseconds time) const { return TickRate{can.tick_hz}.ticks(time).count; }
  /// Software makes its edges: a word may go out late, and is counted then.
  bool best_effort() const { return can.lateness != 0; }
  /// A length that any board can play for ever: 200 us, or four records where its engine asks for more.
  std::uint32_t word() const;
  protocol::ProgramRules rules() const;

  // Requests; the code of the reply.
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
  std::uint64_t now();  ///< of the board; 0 if it does not tell

  // Whole steps; a failed verdict names the one that went wrong.
  /// Every line, nothing limited, outputs low when safe.
  void plain_config();
  Verdict configure();
  /// Begin and all chunks.
  Verdict send_program(const Bytes& program);
  Verdict upload(const Bytes& program);
  Verdict load(const Bytes& program);
  Verdict run_to_end(const Bytes& program, Nanoseconds timeout);
  Verdict await_done(Nanoseconds timeout);
  Verdict in_state(symrig_wire_State state);
  /// All outputs at the safe levels of `config`.
  Verdict outputs_safe();
  const symrig_wire_RunDone& done() const;
  /// What the last run tells of late words. Hardware makes none. A best-effort board counts them: at least
  /// `seen`, those that edges have shown, and no more than it has put out.
  Verdict late_as_told(std::size_t seen = 0) const;
  /// A best-effort board has stopped by itself because a word's whole time had gone by: the machine was busy.
  bool underran();

  /// What configure() sets.
  protocol::BoardConfig config;
  std::uint32_t program_id = 1;
  std::uint32_t program_hash = 0;
  std::uint32_t config_hash = 0;
  symrig_wire_CommitReply committed = symrig_wire_CommitReply_init_zero;
};

}  // namespace symrig::conformance
