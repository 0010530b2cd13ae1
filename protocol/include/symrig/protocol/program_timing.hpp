// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/program_rules.hpp"

namespace symrig::protocol {

/// Interprets a structurally sound program to find how long it takes and whether a line breaks its limits.
///
/// A loop body is gone through twice, whatever its rounds. Twice is enough: a line that changes in the second
/// round leaves it in the same state as it left every later one (the run it ends with began inside the body,
/// and the pulse before that began no earlier than the seam), and the seam between first and second round is
/// at least as demanding as any later one. A line that keeps its level all through the second round stays so,
/// and its run grows by the duration of the body for each round left. So the work is at most 2^depth looks at
/// a record.
template <class Sink>
class TimingCheck {
 public:
  TimingCheck(const ProgramRules& rules, Sink& sink) : rules_(rules), sink_(sink) {}

  /// true: nothing found. timing() is meaningful then.
  bool run(ProgramView program) {
    pc_ = 0;
    while (pc_ < program.size() && going_) {
      step(program[pc_]);
      ++pc_;
    }
    if (going_ && timing_.max >= kMaxDuration) emit({Rule::too_long, pc_ - 1, 0, timing_.max, kMaxDuration});
    return sound_;
  }

  const ProgramTiming& timing() const { return timing_; }

 private:
  /// One line's present run at one level. "on" is away from the safe level. Lines start off, rested.
  struct Run {
    bool on = false;
    bool reported = false;
    uint64_t longest = 0;              // this run, waits run out
    uint64_t shortest = kMaxDuration;  // this run, awaited edges come at once
    uint64_t on_before = 0;            // the pulse before this rest, at its longest
  };

  struct Frame {
    uint32_t body = 0;
    uint32_t rounds = 0;
    bool second = false;
    uint32_t moved = 0;  // lines that changed in this round
    ProgramTiming at;    // timing at the begin of this round
  };

  void step(const Record& record) {
    switch (static_cast<Op>(record.op)) {
      case Op::set_word:
        move(record.arg);
        ++timing_.steps;
        return pass(record.ticks, record.ticks);
      case Op::wait_edge:
        return pass(rules_.wait_latency, uint64_t{record.ticks} + rules_.wait_latency);
      case Op::loop:
        frames_[depth_++] = {pc_ + 1, record.arg, false, 0, timing_};
        return;
      case Op::end_loop:
        return end_loop();
      case Op::mark:
        ++timing_.marks;
        return;
      case Op::end:
        return end(record.arg);
    }
  }

  void end_loop() {
    Frame& frame = frames_[depth_ - 1];
    if (frame.rounds >= 2 && !frame.second) {
      frame.second = true;
      frame.moved = 0;
      frame.at = timing_;
      pc_ = frame.body - 1;
      return;
    }
    if (frame.rounds > 2) repeat(frame, frame.rounds - 2);
    --depth_;
  }

  /// Adds `rounds` further rounds without going through them.
  void repeat(const Frame& frame, uint64_t rounds) {
    const uint64_t shortest = scaled(timing_.min - frame.at.min, rounds);
    const uint64_t longest = scaled(timing_.max - frame.at.max, rounds);
    timing_.steps = sum(timing_.steps, scaled(timing_.steps - frame.at.steps, rounds));
    timing_.marks = sum(timing_.marks, scaled(timing_.marks - frame.at.marks, rounds));
    pass_except(frame.moved, shortest, longest);
  }

  void pass(uint64_t shortest, uint64_t longest) { pass_except(0, shortest, longest); }

  /// Time goes by; the lines in `moved` are known to end it with the run they have now.
  void pass_except(uint32_t moved, uint64_t shortest, uint64_t longest) {
    timing_.min = sum(timing_.min, shortest);
    timing_.max = sum(timing_.max, longest);
    for (unsigned k = 0; k < kMaxOutputs; ++k) {
      if (!limited(k) || ((moved >> k) & 1U) != 0) continue;
      Run& run = runs_[k];
      run.shortest = sum(run.shortest, shortest);
      run.longest = sum(run.longest, longest);
      const uint64_t limit = rules_.config->lines[k].max_on;
      if (run.on && limit != 0 && run.longest > limit) report(k, Rule::max_on, run.longest, limit);
    }
  }

  void move(uint32_t levels) {
    for (unsigned k = 0; k < kMaxOutputs; ++k) {
      if (!limited(k)) continue;
      const bool on = (((levels >> k) & 1U) != 0) != rules_.config->lines[k].safe_level;
      if (on != runs_[k].on) turn(k, on);
    }
  }

  void turn(unsigned k, bool on) {
    Run& run = runs_[k];
    if (on) check_rest(k);
    run.on_before = run.longest;  // meaningful when the pulse ends
    run.on = on;
    run.reported = false;
    run.longest = 0;
    run.shortest = 0;
    for (unsigned d = 0; d < depth_; ++d) frames_[d].moved |= 1U << k;
  }

  void check_rest(unsigned k) {
    const Run& run = runs_[k];
    const LineConfig& line = rules_.config->lines[k];
    if (run.shortest < line.min_off) report(k, Rule::min_off, run.shortest, line.min_off);
    const uint64_t rest = rest_after(run.on_before, line.max_duty_permille);
    if (run.shortest < rest) report(k, Rule::duty, run.shortest, rest);
  }

  /// A line left on is on for ever.
  void end(uint32_t levels) {
    move(levels);
    for (unsigned k = 0; k < kMaxOutputs; ++k) {
      const LineConfig& line = rules_.config->lines[k];
      if (!limited(k) || !runs_[k].on) continue;
      if (line.max_on != 0) report(k, Rule::max_on, kMaxDuration, line.max_on);
      if (rest_after(1, line.max_duty_permille) != 0) report(k, Rule::duty, 0, kMaxDuration);
    }
  }

  bool limited(unsigned k) const {
    const LineConfig& line = rules_.config->lines[k];
    return line.configured && line.output && line.limited();
  }

  // All sums stop at kMaxDuration: a program that long is refused, whatever else it does.
  static uint64_t sum(uint64_t a, uint64_t b) { return a + b < kMaxDuration ? a + b : kMaxDuration; }
  static uint64_t scaled(uint64_t a, uint64_t rounds) {
    return a != 0 && rounds > kMaxDuration / a ? kMaxDuration : a * rounds;
  }

  void report(unsigned line, Rule rule, uint64_t actual, uint64_t limit) {
    if (runs_[line].reported) return;  // one finding a run: a pulse that is too long stays too long
    runs_[line].reported = true;
    emit({rule, pc_, line, actual, limit});
  }
  void emit(const Violation& violation) {
    sound_ = false;
    if (going_) going_ = sink_(violation);
  }

  const ProgramRules& rules_;
  Sink& sink_;
  ProgramTiming timing_;
  Run runs_[kMaxOutputs];
  Frame frames_[kMaxLoopDepth];
  uint32_t depth_ = 0;
  uint32_t pc_ = 0;
  bool going_ = true;
  bool sound_ = true;
};

}  // namespace symrig::protocol
