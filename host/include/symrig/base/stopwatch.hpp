// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"

namespace symrig {

/// Time of the host's steady clock (CLOCK_MONOTONIC), which every link to a real board uses.
Nanoseconds steady_now();

/// Tells how long ago it was made. Assign a new one to start again.
class Stopwatch {
 public:
  Nanoseconds elapsed() const { return steady_now() - start_; }
  double seconds() const { return symrig::seconds(elapsed()); }

 private:
  Nanoseconds start_ = steady_now();
};

/// A moment of the steady clock: `wait` after it was made. For time-outs of waits in several steps.
class Deadline {
 public:
  explicit Deadline(Nanoseconds wait) : at_(steady_now() + wait) {}

  /// 0 from the moment on.
  Nanoseconds left() const;
  bool passed() const { return left().count() == 0; }

 private:
  Nanoseconds at_;
};

}  // namespace symrig
