// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/core.hpp"

namespace symrig::firmware {

using hal::Tick;
using protocol::Rule;

Core::Core(const hal::Board& board, const Memory& memory)
    : board_(board),
      events_(memory.events, memory.event_count),
      link_(board.link, events_, board.traits.tick_hz),
      store_(memory.program),
      sequencer_(board.engine, memory.marks),
      beacon_(board.indicator, board.traits.tick_hz) {}

void Core::boot() {
  load_stored_config();
  reset_fault_ = board_.faults.load();
  const bool stood_still = board_.system.reset_cause() == hal::ResetCause::watchdog;
  if (stood_still && reset_fault_.code == 0)
    reset_fault_ = {static_cast<uint32_t>(symrig_wire_FaultCode_FAULT_WATCHDOG), 0, 0};
  board_.faults.save({});  // reported from memory until the next reset
  board_.engine.set_trips(0, 0);
  use_safe_levels(safe_levels_);
  apply(Condition::boot_done);
}

void Core::poll() {
  watch_edges();
  watch_limits();
  watch_trips();
  watch_chatter();  // after trips: an interlock that opened is the cause that matters
  run_on();
  received_ = board_.clock.now();
  link_.receive(*this, received_);
  watch_host();
  read_program();
  link_.send_events(board_.clock.now());
  leave();
  beacon_.show(state_, board_.clock.now());
  if (!starving_) board_.watchdog.feed();
}

bool Core::apply(Condition condition) {
  const Transition to = transition(state_, condition);
  if (!to.allowed) return false;
  state_ = to.next;
  act(to.actions);
  return true;
}

bool Core::permit(Condition condition, symrig_wire_Reply& reply) {
  const State before = state_;
  if (apply(condition)) return true;
  reply.code = symrig_wire_Code_CODE_BAD_STATE;
  reply.detail = static_cast<uint64_t>(before);
  return false;
}

void Core::act(uint8_t actions) {
  if ((actions & action::force_safe) != 0) {
    board_.engine.force(safe_levels_);
    sequencer_.stop(board_.clock.now());
  }
  if ((actions & action::drop_program) != 0) store_.drop();
  if ((actions & action::drop_config) != 0) config_.clear();
  if (state_ == State::safe) config_hash_ = 0;
}

void Core::use_safe_levels(uint32_t levels) {
  safe_levels_ = levels;
  board_.engine.set_safe(levels);
}

bool Core::exposed() const {
  switch (state_) {
    case State::armed:
    case State::running:
      return true;
    case State::configured:
    case State::loaded:
    case State::done:
      return board_.engine.levels() != safe_levels_;
    default:
      return false;
  }
}

void Core::watch_edges() {
  hal::CapturedEdge edge;
  unsigned left = kEdgesPerPoll;
  while (left > 0 && board_.capture.pop(edge)) {
    watch_edge(edge);
    --left;
  }
  more_edges_ = left == 0;
  if (board_.capture.take_overflow() && guard_.watching())
    raise(symrig_wire_FaultCode_FAULT_CAPTURE_OVERFLOW, 0);
}

/// An input that is not configured may change as it likes.
void Core::watch_chatter() {
  for (uint32_t left = board_.capture.take_chatter(); left != 0; left &= left - 1) {
    const unsigned line = protocol::lowest_bit(left);
    if (config_.line(line).configured && exposed()) raise(symrig_wire_FaultCode_FAULT_CHATTER, line);
  }
}

/// The event under construction. The caller fills it in and pushes it before it does anything else. The queue
/// holds copies.
symrig_wire_Event& Core::new_event(pb_size_t which) {
  __builtin_memset(&event_, 0, sizeof event_);
  event_.which_body = which;
  return event_;
}

void Core::watch_edge(const hal::CapturedEdge& edge) {
  Breach found;
  if (guard_.edge(edge, found)) breach(found);
  if (edge.line >= protocol::kMaxLines || !config_.lines[edge.line].capture) return;
  event_.which_body = symrig_wire_Event_edge_tag;  // without new_event(): edges come in thousands
  event_.body.edge = {edge.line, edge.level, edge.tick};
  events_.push(event_, edge.tick);
}

void Core::watch_limits() {
  Breach found;
  if (guard_.check(board_.clock.now(), found)) breach(found);
}

/// The engine went to its safe word by itself after a trip. This does the rest.
void Core::watch_trips() {
  const uint32_t tripped = board_.engine.tripped();
  if (tripped == 0) return;
  const bool armed = state_ == State::armed || state_ == State::running || state_ == State::configured ||
                     state_ == State::loaded || state_ == State::done;
  board_.engine.set_trips(0, 0);
  if (armed) raise(symrig_wire_FaultCode_FAULT_INTERLOCK, protocol::lowest_bit(tripped));
}

void Core::breach(const Breach& breach) {
  symrig_wire_FaultCode code = symrig_wire_FaultCode_FAULT_DUTY;
  if (breach.rule == Rule::max_on) code = symrig_wire_FaultCode_FAULT_MAX_ON;
  if (breach.rule == Rule::min_off) code = symrig_wire_FaultCode_FAULT_MIN_OFF;
  raise({static_cast<uint32_t>(code), breach.tick, breach.line});
}

void Core::run_on() {
  send_marks();
  const Tick begin = board_.clock.now();
  if (sequencer_.running()) note_round(begin);
  const Sequencer::Outcome outcome = sequencer_.poll(begin);
  note_refill(begin);
  begin_round();
  send_marks();
  if (outcome != Sequencer::Outcome::idle && outcome != Sequencer::Outcome::running) conclude(outcome);
}

void Core::begin_round() {
  refilled_ = board_.clock.now();
  slept_ = 0;
}

/// Checks the board's poll_ticks in the field.
void Core::note_round(Tick begin) {
  const auto took = static_cast<uint32_t>(begin - refilled_ - slept_);
  if (took > longest_round_) longest_round_ = took;
}

/// Checks the board's refill_ticks in the field.
void Core::note_refill(Tick begin) {
  const uint32_t records = sequencer_.take_expanded();
  if (records < hal::kRefillSample) return;
  const uint32_t each = static_cast<uint32_t>(board_.clock.now() - begin) / records;
  if (each > worst_refill_) worst_refill_ = each;
}

void Core::send_marks() {
  PassedMark mark;
  const Tick now = board_.clock.now();
  while (sequencer_.take_mark(now, mark)) {
    event_.which_body = symrig_wire_Event_step_mark_tag;  // without new_event(): marks come in thousands
    event_.body.step_mark = {mark.id, mark.ordinal, mark.tick};
    events_.push(event_, mark.tick);
  }
}

void Core::conclude(Sequencer::Outcome outcome) {
  // An interlock may have stopped the engine since watch_trips(). Then the interlock ended the run.
  if (board_.engine.tripped() != 0) return watch_trips();
  if (outcome == Sequencer::Outcome::underrun) {
    raise(symrig_wire_FaultCode_FAULT_UNDERRUN, sequencer_.tally().steps);
  } else if (outcome == Sequencer::Outcome::wait_timeout) {
    apply(Condition::run_cut);
    report_run(symrig_wire_RunEnd_RUN_END_WAIT_TIMEOUT);
  } else {
    apply(Condition::run_complete);
    report_run(symrig_wire_RunEnd_RUN_END_COMPLETED);
  }
}

void Core::report_run(symrig_wire_RunEnd end) {
  send_marks();
  const RunTally& tally = sequencer_.tally();
  symrig_wire_Event& event = new_event(symrig_wire_Event_run_done_tag);
  const Tick duration = tally.ended > tally.started ? tally.ended - tally.started : 0;  // 0: no start
  const bool waited = end == symrig_wire_RunEnd_RUN_END_WAIT_TIMEOUT;
  event.body.run_done = {end,
                         tally.ended,
                         duration,
                         tally.steps,
                         tally.underruns,
                         tally.late,
                         waited ? sequencer_.waited_at() : 0,
                         events_.lost()};
  events_.push_important(event, tally.ended);
}

/// A host must be present while outputs may change or are away from their safe levels. The exception is an
/// autonomous run, which is not possible with lamp or laser lines.
void Core::watch_host() {
  const Tick now = board_.clock.now();
  const bool silent = ttl_ms_ != 0 && now >= alive_until_;
  const bool gone = !board_.link.attached();
  const bool at_risk = exposed() && !autonomous_;
  if (!silent && !(gone && at_risk)) return;
  const uint64_t ttl = ttl_ms_;
  ttl_ms_ = 0;
  alive_until_ = hal::kNever;
  if (at_risk && silent) {
    raise(symrig_wire_FaultCode_FAULT_KEEP_ALIVE, ttl);
  } else if (at_risk) {
    raise(symrig_wire_FaultCode_FAULT_LINK_LOST, 0);
  } else if (!autonomous_) {
    apply(Condition::host_lost);
  }
}

void Core::leave() {
  if (board_.clock.now() < reboot_at_) return;
  reboot_at_ = hal::kNever;
  board_.system.reboot(to_bootloader_);
}

/// Makes the outputs safe first, then does everything else.
void Core::raise(const hal::FaultRecord& fault) {
  const bool running = state_ == State::running;
  const bool latched = state_ == State::fault;
  apply(Condition::fault);
  if (latched) return;
  fault_ = fault;
  board_.faults.save(fault_);
  symrig_wire_Event& event = new_event(symrig_wire_Event_fault_tag);
  event.body.fault = {static_cast<symrig_wire_FaultCode>(fault.code), fault.tick, fault.arg};
  events_.push_important(event, fault.tick);
  if (running) report_run(symrig_wire_RunEnd_RUN_END_FAULT);
}

bool Core::busy() const {
  const bool reading = store_.working() && state_ != State::armed && state_ != State::running;
  return link_.hungry() || reading || more_edges_;
}

Tick Core::next_deadline() const {
  const Tick now = board_.clock.now();
  if (busy()) return now;
  const Tick deadlines[] = {
      guard_.next_deadline(),    sequencer_.next_deadline(), link_.next_deadline(), alive_until_, reboot_at_,
      beacon_.next_deadline(now)};
  Tick first = hal::kNever;
  for (const Tick deadline : deadlines)
    if (deadline < first) first = deadline;
  return first;
}

}  // namespace symrig::firmware
