// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/sequencer.hpp"

namespace symrig::firmware {

using hal::Tick;
using protocol::Op;
using protocol::Record;
using protocol::WaitFor;

void Sequencer::begin(protocol::ProgramView program, uint32_t min_dwell, uint32_t wait_latency, Tick at,
                      Tick now) {
  program_ = program;
  min_dwell_ = min_dwell;
  wait_latency_ = wait_latency;
  pc_ = 0;
  depth_ = 0;
  mark_count_ = 0;
  ordinal_ = 0;
  tally_ = {};
  begin_stretch(at > now ? at : now);
  tally_.started = base_;
}

void Sequencer::begin_stretch(Tick at) {
  base_ = at;
  offset_ = 0;
  pushed_ = 0;
  engine_on_ = false;
  final_word_ = 0;
  phase_ = Phase::filling;
  fill();
  if (pushed_ == 0) return;
  base_ = engine_.start(at);
  engine_on_ = true;
  if (base_ > at) ++tally_.late;
}

void Sequencer::fill() {
  while (phase_ == Phase::filling && expand(program_[pc_])) {
  }
}

/// false: no room for this record yet.
bool Sequencer::expand(const Record& record) {
  switch (static_cast<Op>(record.op)) {
    case Op::set_word:
      return add_word(record);
    case Op::mark:
      return add_mark(record.arg);
    case Op::loop:
      loops_[depth_++] = {++pc_, record.arg};
      return true;
    case Op::end_loop:
      turn_round();
      return true;
    case Op::wait_edge:
      protocol::parse_wait(record.arg, awaited_);
      timeout_ = record.ticks;
      edge_seen_ = false;
      end_stretch(Phase::before_wait);
      return true;
    case Op::end:
      return finish(record.arg);
  }
  return false;
}

bool Sequencer::add_word(const Record& record) {
  if (engine_.room() == 0) return false;
  engine_.push({record.arg, record.ticks});
  ++pushed_;
  offset_ += record.ticks;
  ++pc_;
  return true;
}

bool Sequencer::add_mark(uint32_t id) {
  if (mark_count_ == kMarks) return false;
  marks_[(mark_first_ + mark_count_++) % kMarks] = {id, offset_};
  ++pc_;
  return true;
}

void Sequencer::turn_round() {
  Loop& loop = loops_[depth_ - 1];
  if (--loop.left > 0) {
    pc_ = loop.body;
    return;
  }
  --depth_;
  ++pc_;
}

/// The run ends with the edge to the final levels; the engine holds them for its shortest dwell before it
/// idles.
bool Sequencer::finish(uint32_t levels) {
  if (engine_.room() == 0) return false;
  engine_.push({levels, min_dwell_});
  ++pushed_;
  final_word_ = 1;
  end_stretch(Phase::before_end);
  return true;
}

void Sequencer::end_stretch(Phase phase) {
  if (pushed_ > 0) engine_.close();
  phase_ = phase;
}

void Sequencer::edge(const hal::CapturedEdge& edge) {
  const bool waits = phase_ == Phase::before_wait || phase_ == Phase::waiting;
  if (!waits || edge_seen_ || edge.line != awaited_.line) return;
  if (edge.tick < barrier() || edge.tick - barrier() > timeout_) return;
  if (awaited_.edge == (edge.level ? WaitFor::falling : WaitFor::rising)) return;
  edge_seen_ = true;
  edge_tick_ = edge.tick;
}

Sequencer::Outcome Sequencer::poll(Tick now) {
  if (phase_ == Phase::idle) return Outcome::idle;
  if (engine_on_ && engine_.underrun()) {
    ++tally_.underruns;
    return conclude(Outcome::underrun, now);
  }
  if (phase_ == Phase::filling) fill();
  const bool played = now >= barrier() && (!engine_on_ || engine_.idle());
  if (phase_ == Phase::before_end && played) return conclude(Outcome::complete, barrier());
  if (phase_ == Phase::before_wait && played) phase_ = Phase::waiting;
  return phase_ == Phase::waiting ? wait(now) : Outcome::running;
}

Sequencer::Outcome Sequencer::wait(Tick now) {
  const Tick runs_out = barrier() + timeout_;
  if (edge_seen_) {
    resume(edge_tick_ + wait_latency_);
  } else if (now >= runs_out) {
    if (awaited_.abort_on_timeout) return conclude(Outcome::wait_timeout, runs_out);
    resume(runs_out + wait_latency_);
  }
  return Outcome::running;
}

void Sequencer::resume(Tick at) {
  if (engine_on_) tally_.steps += engine_.played();
  ++pc_;
  begin_stretch(at);
}

Sequencer::Outcome Sequencer::conclude(Outcome outcome, Tick tick) {
  stop(tick);
  return outcome;
}

void Sequencer::stop(Tick now) {
  if (phase_ == Phase::idle) return;
  const bool end_shown = phase_ == Phase::before_end && now >= barrier();
  if (engine_on_) tally_.steps += engine_.played() - (end_shown ? final_word_ : 0);
  tally_.ended = now;
  phase_ = Phase::idle;
  while (mark_count_ > 0 && base_ + marks_[(mark_first_ + mark_count_ - 1) % kMarks].offset > now)
    --mark_count_;
}

bool Sequencer::take_mark(Tick now, PassedMark& mark) {
  if (mark_count_ == 0 || base_ + marks_[mark_first_].offset > now) return false;
  mark = {marks_[mark_first_].id, ordinal_++, base_ + marks_[mark_first_].offset};
  mark_first_ = (mark_first_ + 1) % kMarks;
  --mark_count_;
  return true;
}

Tick Sequencer::next_deadline() const {
  if (phase_ == Phase::idle) return hal::kNever;
  Tick deadline = hal::kNever;
  if (mark_count_ > 0) deadline = base_ + marks_[mark_first_].offset;
  Tick phase_end = hal::kNever;
  if (phase_ == Phase::before_wait) phase_end = barrier();
  if (phase_ == Phase::before_end) phase_end = barrier() + min_dwell_;
  if (phase_ == Phase::waiting) phase_end = edge_seen_ ? edge_tick_ : barrier() + timeout_;
  return phase_end < deadline ? phase_end : deadline;
}

}  // namespace symrig::firmware
