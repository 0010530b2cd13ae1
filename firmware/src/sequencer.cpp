// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/sequencer.hpp"

namespace symrig::firmware {

using hal::Tick;
using protocol::Op;
using protocol::Record;

void Sequencer::begin(protocol::ProgramView program, uint32_t min_dwell, Tick at) {
  program_ = program;
  min_dwell_ = min_dwell;
  pc_ = 0;
  depth_ = 0;
  levels_ = engine_.levels();
  stretch_ = 0;
  known_ = 0;
  offset_ = 0;
  mark_first_ = 0;
  mark_count_ = 0;
  ordinal_ = 0;
  tally_ = {};
  phase_ = Phase::filling;
  polled_ = 0;
  fill();
  expanded_ = 0;  // a start has no deadline
  base(0) = engine_.start(at);
  if (at != 0 && base(0) > at) ++tally_.late;
  tally_.started = base(0);
}

/// Reads the engine's room() only when the last value is used up: room() costs as much time as push().
void Sequencer::fill() {
  room_ = engine_.room();
  while (phase_ == Phase::filling && expand(program_[pc_])) {
    ++expanded_;
    if (room_ == 0) room_ = engine_.room();
  }
}

void Sequencer::push(const hal::Segment& segment) {
  engine_.push(segment);
  --room_;
}

/// false: there is no room for this record yet.
bool Sequencer::expand(const Record& record) {
  switch (static_cast<Op>(record.op)) {
    case Op::set_word:
      return add_word(record);
    case Op::mark:
      return add_mark(record.arg);
    case Op::loop:
      loops_[depth_++] = {++pc_, protocol::loop_rounds(record)};
      return true;
    case Op::end_loop:
      turn_round();
      return true;
    case Op::wait_edge:
      return add_wait(record);
    case Op::end:
      return finish(record.arg);
  }
  return false;
}

bool Sequencer::add_word(const Record& record) {
  if (room_ == 0) return false;
  levels_ = record.arg;
  push({record.arg, record.ticks});
  offset_ += record.ticks;
  ++pc_;
  return true;
}

/// Without a division, which a small processor does by software.
uint32_t Sequencer::slot(uint32_t index) const {
  const uint32_t at = mark_first_ + index;
  return at < marks_.count ? at : at - marks_.count;
}

bool Sequencer::add_wait(const Record& record) {
  if (room_ == 0 || stretch_ - known_ == hal::kMaxWaits) return false;
  protocol::WaitEdge wait;
  protocol::parse_wait(record.arg, wait);
  const auto until = static_cast<hal::Until>(static_cast<uint8_t>(wait.edge) + 1U);
  push({levels_, record.ticks, until, wait.line, wait.abort_on_timeout});
  waits_[stretch_ % hal::kMaxWaits] = {pc_, wait.abort_on_timeout};
  ++stretch_;
  offset_ = 0;
  ++pc_;
  expanded_ += marks_.count / hal::kMaxWaits;
  return true;
}

bool Sequencer::add_mark(uint32_t id) {
  if (mark_count_ == marks_.count) return false;
  marks_.slots[slot(mark_count_)] = {id, stretch_, offset_};
  ++mark_count_;
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

/// The run ends with the edge to the final levels. The engine holds them for its shortest word before it is
/// idle.
bool Sequencer::finish(uint32_t levels) {
  if (room_ == 0) return false;
  push({levels, min_dwell_});
  engine_.close();
  phase_ = Phase::closing;
  return true;
}

bool Sequencer::take_waits() {
  hal::WaitOutcome outcome;
  while (engine_.pop_wait(outcome)) {
    const Wait& wait = waits_[known_ % hal::kMaxWaits];
    waited_at_ = wait.record;
    base(++known_) = outcome.resumed;
    if (!outcome.timed_out || !wait.abort) continue;
    conclude(Outcome::wait_timeout, outcome.tick);
    return true;
  }
  return false;
}

Sequencer::Outcome Sequencer::poll(Tick now) {
  if (phase_ == Phase::idle) return Outcome::idle;
  polled_ = now;
  if (take_waits()) return Outcome::wait_timeout;
  if (engine_.underrun()) {
    ++tally_.underruns;
    return conclude(Outcome::underrun, now);
  }
  fill();
  if (phase_ == Phase::closing && engine_.idle() && known_ == stretch_)
    return conclude(Outcome::complete, base(stretch_) + offset_);
  return Outcome::running;
}

Sequencer::Outcome Sequencer::conclude(Outcome outcome, Tick tick) {
  stop(tick);
  return outcome;
}

void Sequencer::stop(Tick now) {
  if (phase_ == Phase::idle) return;
  const bool at_end = phase_ == Phase::closing && known_ == stretch_;
  const bool end_shown = at_end && now >= base(stretch_) + offset_;
  tally_.steps = engine_.played() - (end_shown ? 1 : 0);
  tally_.late += engine_.late();
  tally_.ended = now;
  phase_ = Phase::idle;
  while (mark_count_ > 0) {
    const QueuedMark& last = mark(mark_count_ - 1);
    if (known(last) && base(last.stretch) + last.offset <= now) break;
    --mark_count_;
  }
}

bool Sequencer::take_mark(Tick now, PassedMark& passed) {
  if (mark_count_ == 0 || !known(mark(0))) return false;
  const QueuedMark& oldest = mark(0);
  const Tick tick = base(oldest.stretch) + oldest.offset;
  if (tick > now) return false;
  passed = {oldest.id, ordinal_++, tick};
  mark_first_ = slot(1);
  --mark_count_;
  return true;
}

Tick Sequencer::next_deadline() const {
  if (phase_ == Phase::idle) return hal::kNever;
  Tick deadline = hal::kNever;
  if (mark_count_ > 0 && known(mark(0))) deadline = base(mark(0).stretch) + mark(0).offset;
  if (phase_ != Phase::closing || known_ != stretch_) return deadline;
  const Tick end = base(stretch_) + offset_ + min_dwell_;
  // If a faulty engine plays beyond the end, another poll will find it idle, not this deadline.
  return end < deadline && end > polled_ ? end : deadline;
}

}  // namespace symrig::firmware
