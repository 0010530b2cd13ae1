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
      sequencer_(board.engine) {}

void Core::boot() {
  reset_fault_ = board_.faults.load().code;
  apply(Condition::boot_done);
}

void Core::poll() {
  watch_edges();
  watch_limits();
  run_on();
  received_ = board_.clock.now();
  link_.receive(*this, received_);
  watch_host();
  link_.send_events(board_.clock.now());
}

bool Core::apply(Condition condition) {
  const Transition& to = transition(state_, condition);
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
  if ((actions & action::drop_config) != 0) config_ = {};
  if (state_ == State::safe) config_hash_ = 0;
}

void Core::watch_edges() {
  hal::CapturedEdge edge;
  while (board_.capture.pop(edge)) watch_edge(edge);
  if (board_.capture.take_overflow() && guard_.watching())
    raise(symrig_wire_FaultCode_FAULT_CAPTURE_OVERFLOW, 0, board_.clock.now());
}

void Core::watch_edge(const hal::CapturedEdge& edge) {
  Breach found;
  if (guard_.edge(edge, found)) breach(found);
  sequencer_.edge(edge);
  if (edge.line >= protocol::kMaxLines || !config_.lines[edge.line].capture) return;
  symrig_wire_Event event = symrig_wire_Event_init_zero;
  event.which_body = symrig_wire_Event_edge_tag;
  event.body.edge = {edge.line, edge.level, edge.tick};
  events_.push(event, edge.tick);
}

void Core::watch_limits() {
  Breach found;
  if (guard_.check(board_.clock.now(), found)) breach(found);
}

void Core::breach(const Breach& breach) {
  symrig_wire_FaultCode code = symrig_wire_FaultCode_FAULT_DUTY;
  if (breach.rule == Rule::max_on) code = symrig_wire_FaultCode_FAULT_MAX_ON;
  if (breach.rule == Rule::min_off) code = symrig_wire_FaultCode_FAULT_MIN_OFF;
  raise(code, breach.line, breach.tick);
}

void Core::run_on() {
  send_marks();
  const Sequencer::Outcome outcome = sequencer_.poll(board_.clock.now());
  send_marks();
  if (outcome != Sequencer::Outcome::idle && outcome != Sequencer::Outcome::running) conclude(outcome);
}

void Core::send_marks() {
  PassedMark mark;
  while (sequencer_.take_mark(board_.clock.now(), mark)) {
    symrig_wire_Event event = symrig_wire_Event_init_zero;
    event.which_body = symrig_wire_Event_step_mark_tag;
    event.body.step_mark = {mark.id, mark.ordinal, mark.tick};
    events_.push(event, mark.tick);
  }
}

void Core::conclude(Sequencer::Outcome outcome) {
  if (outcome == Sequencer::Outcome::underrun) {
    raise(symrig_wire_FaultCode_FAULT_UNDERRUN, sequencer_.tally().steps, board_.clock.now());
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
  symrig_wire_Event event = symrig_wire_Event_init_zero;
  event.which_body = symrig_wire_Event_run_done_tag;
  const Tick duration = tally.ended > tally.started ? tally.ended - tally.started : 0;  // 0: never began
  const bool waited = end == symrig_wire_RunEnd_RUN_END_WAIT_TIMEOUT;
  event.body.run_done = {end,
                         tally.ended,
                         duration,
                         tally.steps,
                         tally.underruns,
                         tally.late,
                         waited ? sequencer_.record() : 0,
                         events_.lost()};
  events_.push_important(event, tally.ended);
}

/// The host must be there whenever outputs may move, or stand where they should not be left alone.
void Core::watch_host() {
  const Tick now = board_.clock.now();
  const bool left_on = state_ == State::done && board_.engine.levels() != safe_levels_;
  const bool exposed = state_ == State::armed || state_ == State::running || left_on;
  const bool silent = ttl_ms_ != 0 && now >= alive_until_;
  const bool gone = !board_.link.attached();
  if (!silent && !(gone && exposed)) return;
  const uint64_t ttl = ttl_ms_;
  ttl_ms_ = 0;
  alive_until_ = hal::kNever;
  if (!exposed) {
    apply(Condition::host_lost);
  } else if (silent) {
    raise(symrig_wire_FaultCode_FAULT_KEEP_ALIVE, ttl, now);
  } else {
    raise(symrig_wire_FaultCode_FAULT_LINK_LOST, 0, now);
  }
}

/// Outputs first, then everything else.
void Core::raise(symrig_wire_FaultCode code, uint64_t arg, Tick tick) {
  const bool running = state_ == State::running;
  const bool latched = state_ == State::fault;
  apply(Condition::fault);
  if (latched) return;
  fault_ = {static_cast<uint32_t>(code), tick, arg};
  board_.faults.save(fault_);
  symrig_wire_Event event = symrig_wire_Event_init_zero;
  event.which_body = symrig_wire_Event_fault_tag;
  event.body.fault = {code, tick, arg};
  events_.push_important(event, tick);
  if (running) report_run(symrig_wire_RunEnd_RUN_END_FAULT);
}

Tick Core::next_deadline() const {
  if (link_.hungry()) return board_.clock.now();
  const Tick deadlines[] = {guard_.next_deadline(), sequencer_.next_deadline(), link_.next_deadline(),
                            alive_until_};
  Tick first = hal::kNever;
  for (const Tick deadline : deadlines)
    if (deadline < first) first = deadline;
  return first;
}

}  // namespace symrig::firmware
