// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"

#include <deque>
#include <optional>

namespace symrig {

/// Estimates the remaining time of a long job from its progress events. It gives no estimate that may be
/// wrong by more than a factor of two. So it needs a lower and an upper bound less than a factor of four
/// apart, and returns their geometric mean.
class TimeToGo {
 public:
  /// seconds: time since the job began; must not decrease.
  void report(const ProgressEvent& event, double seconds);

  /// The remaining seconds. Nothing if they are not known: no rate yet, later stages of unknown length, or
  /// only the work after the last unit remains.
  std::optional<double> seconds() const;

 private:
  struct Moment {
    double seconds;
    std::int64_t done;
  };
  std::optional<double> pace() const;

  std::deque<Moment> moments_;  ///< of the last half of the elapsed time
  bool computing_ = false;      ///< they count steps
  std::int64_t left_ = 0;       ///< units of this stage
  UnitsToCome later_;
};

}  // namespace symrig
