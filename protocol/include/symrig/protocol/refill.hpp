// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/program_rules.hpp"

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

}  // namespace symrig::protocol
