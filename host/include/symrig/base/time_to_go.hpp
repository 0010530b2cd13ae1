// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"

#include <deque>
#include <optional>

namespace symrig {

/// Tells from the events of a long job how long it still takes. A number that may be off by more than a
/// factor of two is worse than none: it is told only where the bounds of what is known lie less than a factor
/// of four apart, and then it is their geometric mean.
class TimeToGo {
 public:
  /// seconds: since the job began, never falling.
  void tell(const ProgressEvent& event, double seconds);

  /// Nothing where nobody knows: no pace yet, later stages not foreseen, or only the work after the last unit
  /// is left.
  std::optional<double> seconds() const;

 private:
  struct Moment {
    double seconds;
    std::int64_t done;
  };
  std::optional<double> pace() const;

  std::deque<Moment> moments_;  ///< of the last half of the time
  std::int64_t left_ = 0;       ///< units of this stage
  UnitsToCome later_;
};

}  // namespace symrig
