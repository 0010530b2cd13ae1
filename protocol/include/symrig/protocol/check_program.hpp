// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/program.hpp"
#include "symrig/protocol/program_timing.hpp"

namespace symrig::protocol {

/// Checks each record and the nesting of loops. Reads every record once.
/// Sink: bool(const Violation&), true = continue.
template <class Sink>
class StructureCheck {
 public:
  StructureCheck(const ProgramRules& rules, Sink& sink) : rules_(&rules), sink_(&sink) {}

  void restart() { *this = StructureCheck(*rules_, *sink_); }

  /// Reads up to `looks` more records. true: all are read, and sound() is the verdict.
  bool advance(ProgramView program, uint32_t looks) {
    const size_t bytes = program.bytes.size;
    if (bytes == 0 || bytes % kRecordSize != 0 || bytes > rules_->max_bytes) {
      report(Rule::length, bytes, rules_->max_bytes);
      return true;
    }
    for (; looks > 0 && going_ && index_ < program.size(); --looks, ++index_)
      look(program[index_], index_ + 1 == program.size());
    if (going_ && index_ < program.size()) return false;
    if (going_ && depth_ > 0) report_at(opened_[depth_ - 1], Rule::loop_balance, depth_, 0);
    return true;
  }

  bool sound() const { return sound_; }

 private:
  void look(const Record& record, bool last) {
    if (last != record.is(Op::end)) report(Rule::no_end, index_, 0);
    if (!record.is(Op::mark) && !record.is(Op::loop) && !record.is(Op::end_loop)) marks_ = 0;
    switch (static_cast<Op>(record.op)) {
      case Op::set_word:
        return word(record);
      case Op::loop:
        return loop(record);
      case Op::end_loop:
        return end_loop(record);
      case Op::wait_edge:
        return wait(record);
      case Op::mark:
        return mark(record);
      case Op::end:
        return end(record);
    }
    report(Rule::bad_op, record.op, 0);
  }

  void word(const Record& record) {
    outputs_only(record.arg);
    if (record.ticks < rules_->min_dwell) report(Rule::min_dwell, record.ticks, rules_->min_dwell);
    if (record.ticks > rules_->max_dwell) report(Rule::max_dwell, record.ticks, rules_->max_dwell);
    took_time();
  }

  void loop(const Record& record) {
    const uint64_t rounds = loop_rounds(record);
    if (rounds == 0 || rounds > kMaxRounds) report(Rule::loop_rounds, rounds, rounds == 0 ? 1 : kMaxRounds);
    if (depth_ == kMaxLoopDepth || depth_ >= rules_->loop_depth) {
      report(Rule::loop_depth, depth_ + 1, rules_->loop_depth);
      going_ = false;  // later loop ends cannot be paired any more
      return;
    }
    opened_[depth_] = index_;
    timed_[depth_++] = false;
  }

  void end_loop(const Record& record) {
    if (record.arg != 0 || record.ticks != 0) report(Rule::bad_arg, record.arg, 0);
    if (depth_ == 0) return report(Rule::loop_balance, 0, 1);
    if (!timed_[--depth_]) report(Rule::idle_loop, 0, 0);
  }

  void wait(const Record& record) {
    WaitEdge edge;
    if (!parse_wait(record.arg, edge)) return report(Rule::bad_arg, record.arg, 0);
    const LineConfig line = rules_->config->line(edge.line);
    const bool input = line.configured && !line.output;
    if (!input) report_line(edge.line, Rule::not_an_input);
    if (input && !can_wait(edge)) report_line(edge.line, Rule::wait_kind);
    if (record.ticks == 0 || record.ticks > rules_->max_dwell)
      report(Rule::max_dwell, record.ticks, rules_->max_dwell);
    took_time();
  }

  bool can_wait(const WaitEdge& wait) const {
    return ((rules_->no_waits[wait.line] >> static_cast<unsigned>(wait.edge)) & 1U) == 0;
  }

  void mark(const Record& record) {
    if (record.ticks != 0) report(Rule::bad_arg, record.ticks, 0);
    if (++marks_ == kMaxMarksInARow + 1) report(Rule::mark_crowd, marks_, kMaxMarksInARow);
  }

  void end(const Record& record) {
    outputs_only(record.arg);
    if (record.ticks != 0) report(Rule::bad_arg, record.ticks, 0);
  }

  void outputs_only(uint32_t levels) {
    for (uint32_t left = levels; left != 0; left &= left - 1) {
      const unsigned k = lowest_bit(left);
      const LineConfig line = rules_->config->line(k);
      if (!(line.configured && line.output)) report_line(k, Rule::not_an_output);
    }
  }

  void took_time() {
    for (unsigned k = 0; k < depth_; ++k) timed_[k] = true;
  }

  void report(Rule rule, uint64_t actual, uint64_t limit) { report_at(index_, rule, actual, limit); }
  void report_at(uint32_t record, Rule rule, uint64_t actual, uint64_t limit) {
    emit({rule, record, 0, actual, limit});
  }
  void report_line(uint32_t line, Rule rule) { emit({rule, index_, line, 0, 0}); }
  void emit(const Violation& violation) {
    sound_ = false;
    if (going_) going_ = (*sink_)(violation);
  }

  const ProgramRules* rules_;
  Sink* sink_;
  uint32_t index_ = 0;
  uint32_t depth_ = 0;
  uint32_t marks_ = 0;
  uint32_t opened_[kMaxLoopDepth] = {};
  bool timed_[kMaxLoopDepth] = {};
  bool going_ = true;
  bool sound_ = true;
};

/// Checks a program against the rules of a board. The host's linter uses it, and the firmware at commit.
/// Sink: bool(const Violation&), called for each violation; false ends the search. The work is bounded by the
/// number of records (at most 17 readings each) for any number of rounds, and can be done in slices.
template <class Sink>
class ProgramCheck {
 public:
  /// rules and sink must outlive the check.
  ProgramCheck(const ProgramRules& rules, Sink& sink) : structure_(rules, sink), time_(rules, sink) {}

  /// Begins again, with the present rules and sink.
  void restart() {
    structure_.restart();
    time_.restart();
    structured_ = false;
    done_ = false;
  }

  /// Reads up to `looks` records. true: done.
  bool advance(ProgramView program, uint32_t looks) {
    if (done_) return true;
    if (!structured_) {
      structured_ = structure_.advance(program, looks);
      done_ = structured_ && !structure_.sound();
    } else {
      done_ = time_.advance(program, looks);
    }
    return done_;
  }

  bool sound() const { return done_ && structure_.sound() && time_.sound(); }
  // Valid if sound().
  const ProgramTiming& timing() const { return time_.timing(); }
  const LineUse& use(unsigned line) const { return time_.use(line); }

 private:
  StructureCheck<Sink> structure_;
  TimingCheck<Sink> time_;
  bool structured_ = false;
  bool done_ = false;
};

/// The same in one call. Fills in the timing if there is no violation.
template <class Sink>
bool check_program(ProgramView program, const ProgramRules& rules, ProgramTiming& timing, Sink&& sink) {
  ProgramCheck<Sink> check(rules, sink);
  while (!check.advance(program, UINT32_MAX)) {
  }
  if (check.sound()) timing = check.timing();
  return check.sound();
}

}  // namespace symrig::protocol
