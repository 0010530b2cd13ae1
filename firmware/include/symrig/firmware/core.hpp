// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/firmware/event_queue.hpp"
#include "symrig/firmware/guard.hpp"
#include "symrig/firmware/link.hpp"
#include "symrig/firmware/program_store.hpp"
#include "symrig/firmware/sequencer.hpp"
#include "symrig/firmware/supervisor.hpp"
#include "symrig/hal/board.hpp"

namespace symrig::firmware {

/// Memory that a board lends to the core for good.
struct Memory {
  protocol::ByteRoom program;           ///< room for one program
  symrig_wire_Event* events = nullptr;  ///< room for events until the host has them
  uint16_t event_count = 0;             ///< a power of two, 8 to 16384
};

/// The firmware: everything a trigger board does, but for the hardware. A board constructs one, calls boot(),
/// then poll() whenever something may have changed and at the latest at next_deadline().
class Core final : private Requests {
 public:
  Core(const hal::Board& board, const Memory& memory);
  Core(const Core&) = delete;
  Core& operator=(const Core&) = delete;

  /// Outputs to their safe levels (all low, before a host says otherwise), then SAFE.
  void boot();
  /// One round: edges, guard, sequencer, host, keep-alive, events. Bounded work; never waits.
  void poll();
  /// Tick at which poll() must be called even if nothing else happens; kNever if there is none.
  hal::Tick next_deadline() const;

  State state() const { return state_; }
  /// The latched fault; code 0 = none.
  const hal::FaultRecord& fault() const { return fault_; }
  uint32_t safe_levels() const { return safe_levels_; }

 private:
  // Requests (requests.cpp)
  void answer(const symrig_wire_Request& request, symrig_wire_Reply& reply) override;
  void take_chunk(const protocol::DataChunk& chunk, symrig_wire_Reply& reply) override;
  void hello(symrig_wire_Reply& reply) const;
  void capabilities(symrig_wire_Reply& reply) const;
  void describe_line(uint32_t line, symrig_wire_Reply& reply) const;
  void configure_line(const symrig_wire_ConfigLine& line, symrig_wire_Reply& reply);
  void finalize_config(uint32_t hash, symrig_wire_Reply& reply);
  void begin_program(const symrig_wire_ProgramBegin& begin, symrig_wire_Reply& reply);
  void commit_program(const symrig_wire_ProgramCommit& commit, symrig_wire_Reply& reply);
  void report_commit(ProgramStore::Commit outcome, symrig_wire_Reply& reply) const;
  void arm(const symrig_wire_Arm& arm, symrig_wire_Reply& reply);
  void start(const symrig_wire_Start& start, symrig_wire_Reply& reply);
  void abort();
  void clear_fault(uint32_t code, symrig_wire_Reply& reply);
  void status(symrig_wire_Reply& reply) const;
  void keep_alive(uint32_t ttl_ms);
  void time(uint64_t host_ns, symrig_wire_Reply& reply) const;
  int hazardous_line() const;

  // core.cpp
  /// Goes through the supervisor's table. false: not allowed in this state, nothing was done.
  bool apply(Condition condition);
  /// The same for a request: a refusal fills in the reply.
  bool permit(Condition condition, symrig_wire_Reply& reply);
  void act(uint8_t actions);
  void watch_edges();
  void watch_edge(const hal::CapturedEdge& edge);
  void watch_limits();
  void run_on();
  void send_marks();
  void conclude(Sequencer::Outcome outcome);
  void watch_host();
  void raise(symrig_wire_FaultCode code, uint64_t arg, hal::Tick tick);
  void report_run(symrig_wire_RunEnd end);
  void breach(const Breach& breach);

  const hal::Board& board_;
  EventQueue events_;
  Link link_;
  ProgramStore store_;
  Sequencer sequencer_;
  Guard guard_;

  State state_ = State::boot;
  protocol::BoardConfig config_;
  uint32_t config_hash_ = 0;
  uint32_t safe_levels_ = 0;
  hal::FaultRecord fault_;
  uint32_t reset_fault_ = 0;
  hal::Tick received_ = 0;  // when the bytes now being worked on were taken
  uint32_t ttl_ms_ = 0;     // keep-alive; 0 = off
  hal::Tick alive_until_ = hal::kNever;
};

}  // namespace symrig::firmware
