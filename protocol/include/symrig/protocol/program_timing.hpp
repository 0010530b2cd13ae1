// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/program.hpp"

namespace symrig::protocol {

/// Proves whether the firmware can keep the edge engine's queue filled, for loops of any length.
///
/// Model: the queue has room for q = queue_segments words or marks, and for kMaxWaitsQueued waits. Filling
/// needs at most c = refill_ticks for a record. After the queue is no longer full, up to w = poll_ticks may
/// pass before filling begins. Then it continues until the queue is full again. A word or mark has the weight
/// 1, a wait has the weight u = q / kMaxWaitsQueued. So whenever filling stops, records of weight q - u or
/// more are queued. If records of weight n are consumed in a busy stretch of t ticks, the queue is not empty
/// as long as n c - t <= (q - u) c - w. This is a leaky bucket: credit x in [0, C], C = (q - u) c - w, starts
/// full, because the queue is filled before the start. Each record takes its weight times c out. The duration
/// of its word in ticks is added.
///
/// One record is the map x -> min(cap, x + gain), allowed if x >= need. So is any sequence of records, and
/// any number of rounds of one, because the maps are closed under composition (max-plus algebra). A loop
/// needs no more work than its body.
class Refill {
 public:
  /// x -> min(cap, x + gain), allowed if x >= need.
  struct Map {
    int64_t gain = 0;
    int64_t cap = kUnbounded;
    int64_t need = 0;

    /// This map first, then `next`.
    constexpr Map then(const Map& next) const {
      return {bounded(gain + next.gain), lesser(bounded(cap + next.gain), next.cap),
              greater(need, next.need - gain)};
    }
  };

  constexpr explicit Refill(const ProgramRules& rules)
      : cost_(rules.refill_ticks),
        wait_weight_((int64_t{rules.queue_segments} + kMaxWaitsQueued - 1) / kMaxWaitsQueued),
        cap_(cost_ * (int64_t{rules.queue_segments} - wait_weight_) - int64_t{rules.poll_ticks}),
        credit_(cap_) {}

  /// True if the board has no refill cost.
  constexpr bool idle() const { return cost_ == 0; }
  /// One record whose word lasts for `ticks` (0 for a record without a word).
  constexpr Map record(uint64_t ticks) const { return {static_cast<int64_t>(ticks) - cost_, cap_, cost_}; }
  /// A wait that ends after `ticks`.
  constexpr Map wait(uint64_t ticks) const {
    return {static_cast<int64_t>(ticks) - cost_ * wait_weight_, cap_, cost_ * wait_weight_};
  }
  /// false: the queue may run empty.
  constexpr bool pass(const Map& map) {
    const bool fed = credit_ >= map.need;
    credit_ = lesser(map.cap, bounded(credit_ + map.gain));
    return fed;
  }
  /// The same sequence `rounds` times (at least once), as one map.
  static constexpr Map power(const Map& map, uint64_t rounds) {
    const int64_t all = scaled(map.gain, rounds);
    if (map.gain >= 0) return {all, map.cap, map.need};
    const int64_t before_last = scaled(map.gain, rounds - 1);
    return {all, bounded(map.cap + before_last), bounded(map.need - before_last)};
  }
  /// How many rounds of a sequence the board can refill from now on, at most `rounds`.
  constexpr uint64_t rounds_fed(const Map& map, uint64_t rounds) const {
    if (credit_ < map.need) return 0;
    if (map.gain >= 0) return rounds;
    const uint64_t fed = static_cast<uint64_t>(credit_ - map.need) / magnitude(map.gain) + 1;
    return fed < rounds ? fed : rounds;
  }
  /// Resets the credit after a finding, so that the next finding is independent.
  constexpr void forgive() { credit_ = cap_; }

 private:
  static constexpr int64_t kUnbounded = int64_t{1}
                                        << 60U;  // much more than any sum of ticks: kMaxDuration is 2^50

  static constexpr int64_t lesser(int64_t a, int64_t b) { return a < b ? a : b; }
  static constexpr int64_t greater(int64_t a, int64_t b) { return a < b ? b : a; }
  static constexpr uint64_t magnitude(int64_t a) { return static_cast<uint64_t>(a < 0 ? -a : a); }
  static constexpr int64_t scaled(int64_t gain, uint64_t rounds) {
    const uint64_t step = magnitude(gain);
    const bool far = step != 0 && rounds > static_cast<uint64_t>(kUnbounded) / step;
    const int64_t size = far ? kUnbounded : static_cast<int64_t>(step * rounds);
    return gain < 0 ? -size : size;
  }
  static constexpr int64_t bounded(int64_t a) { return greater(-kUnbounded, lesser(a, kUnbounded)); }

  int64_t cost_;
  int64_t wait_weight_;
  int64_t cap_;
  int64_t credit_;
};

/// Interprets a program with a valid structure. Finds its duration, lines that break their limits, and
/// whether the board can refill its queue in time.
///
/// A loop body is interpreted twice for any number of rounds. Twice is enough. A line that changes in the
/// second round ends it in the same state as every later round: its last run began inside the body, and the
/// pulse before began no earlier than the border between the rounds. The border between the first and the
/// second round is at least as demanding as any later one. A line without a change in the second round keeps
/// its level, and its run grows by the duration of the body for each remaining round. So each record is read
/// at most 2^depth times.
template <class Sink>
class TimingCheck {
 public:
  TimingCheck(const ProgramRules& rules, Sink& sink) : rules_(&rules), sink_(&sink), refill_(rules) {
    find_outputs();
  }

  /// Begins again, with the present rules. Resets member by member: a temporary of the whole is too large for
  /// a small board's stack.
  void restart() {
    refill_ = Refill(*rules_);
    timing_ = {};
    burning_ = 0;
    for (Run& run : runs_) run = {};
    for (LineUse& use : uses_) use = {};
    depth_ = 0;
    pc_ = 0;
    going_ = true;
    sound_ = true;
    find_outputs();
  }

  /// Reads up to `looks` more records. true: all are read, and sound() is the verdict.
  bool advance(ProgramView program, uint32_t looks) {
    for (; looks > 0 && going_ && pc_ < program.size(); --looks) {
      step(program[pc_]);
      ++pc_;
    }
    return !going_ || pc_ >= program.size();
  }

  bool sound() const { return sound_; }
  /// Valid if all records are read and sound().
  const ProgramTiming& timing() const { return timing_; }
  const LineUse& use(unsigned line) const { return uses_[line]; }

 private:
  /// The present run of one line at one level. "on" is away from the safe level. Lines start off and rested.
  struct Run {
    bool on = false;
    bool rested = true;  // off since before the program
    bool reported = false;
    uint64_t longest_from = 0;   // timing_.max when it began
    uint64_t shortest_from = 0;  // timing_.min when it began
    uint64_t pulse = 0;          // the pulse before this rest, at its longest
  };

  struct Loop {
    uint32_t body = 0;
    uint64_t rounds = 0;
    bool second = false;
    uint32_t moved = 0;  // lines with a change in this round
    ProgramTiming at;    // timing at the begin of this round
    Refill::Map refill;  // the effect of this round on the queue so far
  };

  void find_outputs() {
    outputs_ = 0;
    if (rules_->config == nullptr) return;  // no board yet: no record will be read
    for (unsigned k = 0; k < kMaxOutputs; ++k) {
      const LineConfig& line = rules_->config->lines[k];
      if (line.configured && line.output) outputs_ |= uint32_t{1} << k;
    }
  }

  void step(const Record& record) {
    switch (static_cast<Op>(record.op)) {
      case Op::set_word:
        move(record.arg);
        ++timing_.steps;
        feed(refill_.record(record.ticks));
        return pass(record.ticks, record.ticks);
      case Op::wait_edge:
        feed(refill_.wait(rules_->wait_latency));
        return pass(rules_->wait_latency, uint64_t{record.ticks} + rules_->wait_latency);
      case Op::loop:
        feed(refill_.record(0));
        loops_[depth_++] = {pc_ + 1, loop_rounds(record), false, 0, timing_, {}};
        return;
      case Op::end_loop:
        feed(refill_.record(0));
        return end_loop();
      case Op::mark:
        feed(refill_.record(0));
        ++timing_.marks;
        return;
      case Op::end:
        feed(refill_.record(0));
        return end(record.arg);
    }
  }

  void end_loop() {
    Loop& loop = loops_[depth_ - 1];
    if (loop.rounds >= 2 && !loop.second) {
      loop.second = true;
      loop.moved = 0;
      loop.at = timing_;
      loop.refill = {};
      pc_ = loop.body - 1;
      return;
    }
    --depth_;
    if (loop.rounds > 2) repeat(loop, loop.rounds - 2);
  }

  /// Adds `rounds` further rounds without interpreting them.
  void repeat(const Loop& loop, uint64_t rounds) {
    const uint64_t shortest = scaled(timing_.min - loop.at.min, rounds);
    const uint64_t longest = scaled(timing_.max - loop.at.max, rounds);
    timing_.steps = sum(timing_.steps, scaled(timing_.steps - loop.at.steps, rounds));
    timing_.marks = sum(timing_.marks, scaled(timing_.marks - loop.at.marks, rounds));
    feed_rounds(loop, rounds);
    // A line that changed ends these rounds with its present run, so the run's begin moves with the clock.
    for (uint32_t left = loop.moved; left != 0; left &= left - 1) {
      Run& run = runs_[lowest_bit(left)];
      run.longest_from = sum(run.longest_from, longest);
      run.shortest_from = sum(run.shortest_from, shortest);
    }
    pass(shortest, longest);
  }

  void pass(uint64_t shortest, uint64_t longest) {
    timing_.min = sum(timing_.min, shortest);
    timing_.max = sum(timing_.max, longest);
    if (timing_.max >= kMaxDuration) {
      emit({Rule::too_long, pc_, 0, timing_.max, kMaxDuration});
      going_ = false;  // the sums below are not valid any more
      return;
    }
    for (uint32_t left = burning_; left != 0; left &= left - 1) {
      const unsigned k = lowest_bit(left);
      const uint64_t limit = rules_->config->lines[k].max_on;
      if (limit != 0 && longest_of(runs_[k]) > limit) report(k, Rule::max_on, longest_of(runs_[k]), limit);
    }
  }

  void move(uint32_t levels) {
    for (uint32_t left = outputs_; left != 0; left &= left - 1) {
      const unsigned k = lowest_bit(left);
      const bool on = (((levels >> k) & 1U) != 0) != rules_->config->lines[k].safe_level;
      if (on != runs_[k].on) turn(k, on);
    }
  }

  void turn(unsigned k, bool on) {
    Run& run = runs_[k];
    if (on && !run.rested) check_rest(k);
    if (!on) {
      run.pulse = longest_of(run);
      if (run.pulse > uses_[k].worst_on) uses_[k].worst_on = run.pulse;
    }
    burning_ ^= uint32_t{1} << k;
    run = {on, false, false, timing_.max, timing_.min, run.pulse};
    for (unsigned d = 0; d < depth_; ++d) loops_[d].moved |= uint32_t{1} << k;
  }

  void check_rest(unsigned k) {
    const LineConfig& line = rules_->config->lines[k];
    const uint64_t pulse = runs_[k].pulse;
    const uint64_t off = timing_.min - runs_[k].shortest_from;
    if (off < line.min_off) report(k, Rule::min_off, off, line.min_off);
    const uint64_t rest = rest_after(pulse, line.max_duty_permille);
    if (off < rest) report(k, Rule::duty, off, rest);
    const uint64_t cycle = pulse + off;
    const auto permille = static_cast<uint32_t>((pulse * 1000U + cycle - 1U) / cycle);
    if (permille > uses_[k].worst_duty_permille) uses_[k].worst_duty_permille = permille;
  }

  /// A line that is on after End is on for ever.
  void end(uint32_t levels) {
    move(levels);
    for (uint32_t left = burning_; left != 0; left &= left - 1) {
      const unsigned k = lowest_bit(left);
      const LineConfig& line = rules_->config->lines[k];
      uses_[k] = {kMaxDuration, 1000};
      if (line.max_on != 0) report(k, Rule::max_on, kMaxDuration, line.max_on);
      if (rest_after(1, line.max_duty_permille) != 0) report(k, Rule::duty, 0, kMaxDuration);
    }
  }

  void feed(const Refill::Map& map) {
    if (refill_.idle()) return;
    for (unsigned d = 0; d < depth_; ++d) loops_[d].refill = loops_[d].refill.then(map);
    if (!refill_.pass(map)) starve(static_cast<uint64_t>(map.gain + map.need), rules_->refill_ticks);
  }

  void feed_rounds(const Loop& loop, uint64_t rounds) {
    if (refill_.idle()) return;
    const Refill::Map all = Refill::power(loop.refill, rounds);
    for (unsigned d = 0; d < depth_; ++d) loops_[d].refill = loops_[d].refill.then(all);
    const uint64_t fed = refill_.rounds_fed(loop.refill, rounds);
    if (!refill_.pass(all)) starve(loop.rounds, fed + 2);
  }

  void starve(uint64_t actual, uint64_t limit) {
    refill_.forgive();
    emit({Rule::refill, pc_, 0, actual, limit});
  }

  uint64_t longest_of(const Run& run) const { return timing_.max - run.longest_from; }

  // All sums stop at kMaxDuration, because such a long program is refused in any case.
  static uint64_t sum(uint64_t a, uint64_t b) { return a + b < kMaxDuration ? a + b : kMaxDuration; }
  static uint64_t scaled(uint64_t a, uint64_t rounds) {
    return a != 0 && rounds > kMaxDuration / a ? kMaxDuration : a * rounds;
  }

  void report(unsigned line, Rule rule, uint64_t actual, uint64_t limit) {
    if (runs_[line].reported)
      return;  // only one finding for each run: a pulse that is too long stays too long
    runs_[line].reported = true;
    emit({rule, pc_, line, actual, limit});
  }
  void emit(const Violation& violation) {
    sound_ = false;
    if (going_) going_ = (*sink_)(violation);
  }

  const ProgramRules* rules_;
  Sink* sink_;
  Refill refill_;
  ProgramTiming timing_;
  uint32_t outputs_ = 0;  // lines that programs may change
  uint32_t burning_ = 0;  // lines that are on
  Run runs_[kMaxOutputs];
  LineUse uses_[kMaxOutputs];
  Loop loops_[kMaxLoopDepth];
  uint32_t depth_ = 0;
  uint32_t pc_ = 0;
  bool going_ = true;
  bool sound_ = true;
};

}  // namespace symrig::protocol
