// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/firmware/guard.hpp"
#include "symrig/firmware/link.hpp"
#include "symrig/firmware/program_store.hpp"
#include "symrig/firmware/sequencer.hpp"
#include "symrig/firmware/stored_config.hpp"
#include "symrig/firmware/supervisor.hpp"
#include "symrig/hal/board.hpp"

namespace symrig::firmware {

/// Memory that a board gives to the core permanently.
struct Memory {
  protocol::ByteRoom program;           ///< room for one program
  symrig_wire_Event* events = nullptr;  ///< room for events until the host acknowledges them
  uint16_t event_count = 0;             ///< a power of two, 8 to 16384
  MarkRoom marks;
};

/// The firmware: everything that a trigger board does except the hardware access. A board constructs one and
/// calls boot(). Then it calls poll() after each possible change, and at the latest at next_deadline().
class Core final : private Requests {
 public:
  Core(const hal::Board& board, const Memory& memory);
  Core(const Core&) = delete;
  Core& operator=(const Core&) = delete;

  /// Puts the outputs to their safe levels (those of the last store_config, or all low), then enters SAFE.
  void boot();
  /// One round: edges, guard, sequencer, host, keep-alive, events. Its work is bounded, and it never waits.
  void poll();
  /// The tick at which poll() must be called even if nothing else happens, or kNever.
  hal::Tick next_deadline() const;
  /// True if the last poll left work that the next one can do at once.
  bool busy() const;

  /// The board slept for so many ticks since the last poll(): they are no part of a round.
  void slept(hal::Tick ticks) { slept_ += ticks; }

  State state() const { return state_; }
  /// The latched fault; code 0 = none.
  const hal::FaultRecord& fault() const { return fault_; }
  uint32_t safe_levels() const { return safe_levels_; }

 private:
  // Requests. requests.cpp calls the right function for each.
  Answer answer(const symrig_wire_Request& request, symrig_wire_Reply& reply) override;
  void take_chunk(const protocol::DataChunk& chunk, symrig_wire_Reply& reply) override;
  void answer_now(const symrig_wire_Request& request, symrig_wire_Reply& reply);
  // describe.cpp
  void hello(symrig_wire_Reply& reply) const;
  void capabilities(symrig_wire_Reply& reply) const;
  void describe_line(uint32_t line, symrig_wire_Reply& reply) const;
  void status(symrig_wire_Reply& reply) const;
  void time(uint64_t host_ns, symrig_wire_Reply& reply) const;
  void diagnostics(symrig_wire_Reply& reply) const;
  // configuring.cpp
  void configure_line(const symrig_wire_ConfigLine& line, symrig_wire_Reply& reply);
  void finalize_config(uint32_t hash, symrig_wire_Reply& reply);
  void store_config(const symrig_wire_StoreConfig& store, symrig_wire_Reply& reply);
  void load_stored_config();
  // programming.cpp
  void begin_program(const symrig_wire_ProgramBegin& begin, symrig_wire_Reply& reply);
  Answer commit_program(const symrig_wire_ProgramCommit& commit, symrig_wire_Reply& reply);
  Answer verify_program(symrig_wire_Reply& reply);
  void tell_line_use(uint32_t line, symrig_wire_Reply& reply) const;
  void read_program();
  void conclude_commit(ProgramStore::Verdict verdict, symrig_wire_Reply& reply);
  void report_program(ProgramStore::Verdict verdict, symrig_wire_Reply& reply) const;
  protocol::ProgramRules rules() const;
  // running.cpp
  void arm(const symrig_wire_Arm& arm, symrig_wire_Reply& reply);
  void start(const symrig_wire_Start& start, symrig_wire_Reply& reply);
  void set_by_hand(const symrig_wire_ManualSet& set, symrig_wire_Reply& reply);
  void abort();
  void clear_fault(uint32_t code, symrig_wire_Reply& reply);
  void keep_alive(uint32_t ttl_ms, symrig_wire_Reply& reply);
  void identify(uint32_t seconds, symrig_wire_Reply& reply);
  void reboot(const symrig_wire_Reboot& reboot, symrig_wire_Reply& reply);
  bool may_move(uint32_t mask, hal::Tick tick, symrig_wire_Reply& reply) const;
  /// A restart is under way: nothing may move or be stored any more.
  bool leaving() const { return starving_ || reboot_at_ != hal::kNever; }
  int unguarded_line(uint32_t mask) const;
  int hazardous_line() const;
  int open_interlock() const;
  bool arm_trips(symrig_wire_Reply& reply);
  bool stopped_by_trip(symrig_wire_Reply& reply);
  static bool is_interlock(const protocol::LineConfig& line) {
    return line.configured && line.role == symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
  }

  // core.cpp
  /// Applies the supervisor's table. false: the condition is not allowed in this state, and nothing was done.
  bool apply(Condition condition);
  /// The same for a request. A refusal is written into the reply.
  bool permit(Condition condition, symrig_wire_Reply& reply);
  void act(uint8_t actions);
  void use_safe_levels(uint32_t levels);
  /// True if outputs may change, or are away from their safe levels.
  bool exposed() const;
  void watch_edges();
  void watch_edge(const hal::CapturedEdge& edge);
  void watch_chatter();
  void watch_limits();
  void watch_trips();
  void run_on();
  void begin_round();
  void note_round(hal::Tick begin);
  void note_refill(hal::Tick begin);
  void send_marks();
  void conclude(Sequencer::Outcome outcome);
  void watch_host();
  void leave();
  void raise(symrig_wire_FaultCode code, uint64_t arg) {
    raise({static_cast<uint32_t>(code), board_.clock.now(), arg});
  }
  void raise(const hal::FaultRecord& fault);
  void report_run(symrig_wire_RunEnd end);
  symrig_wire_Event& new_event(pb_size_t which);
  void breach(const Breach& breach);
  hal::Tick ticks_of_ms(uint32_t ms) const { return board_.traits.tick_hz * ms / 1000; }

  static constexpr unsigned kEdgesPerPoll = 16;

  const hal::Board& board_;
  EventQueue events_;
  Link link_;
  ProgramStore store_;
  Sequencer sequencer_;
  Guard guard_;
  Beacon beacon_;

  symrig_wire_Event event_ = symrig_wire_Event_init_zero;  // too large for a small board's stack

  State state_ = State::boot;
  protocol::BoardConfig config_;
  uint32_t config_hash_ = 0;
  uint32_t stored_config_ = 0;
  uint32_t safe_levels_ = 0;
  Label label_;
  hal::FaultRecord fault_;
  hal::FaultRecord reset_fault_;
  hal::Tick received_ = 0;      // when the current bytes were received
  bool more_edges_ = false;     // the last poll left edges for the next one
  bool autonomous_ = false;     // the run continues without a host
  uint32_t ttl_ms_ = 0;         // keep-alive; 0 = off
  uint32_t worst_refill_ = 0;   // ticks per record
  uint32_t longest_round_ = 0;  // ticks from refill to refill, in runs
  hal::Tick refilled_ = 0;      // end of the last refill
  hal::Tick slept_ = 0;         // since then
  hal::Tick alive_until_ = hal::kNever;
  hal::Tick reboot_at_ = hal::kNever;
  bool to_bootloader_ = false;
  bool starving_ = false;  // the watchdog gets no more feeds, at a host's request
};

}  // namespace symrig::firmware
