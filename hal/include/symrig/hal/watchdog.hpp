// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace symrig::hal {

/// Resets the board, with outputs at the levels of power-up, if it is not fed in time. The board sets the
/// time, at most half a second.
class Watchdog {
 public:
  virtual void feed() = 0;

 protected:
  ~Watchdog() = default;
};

}  // namespace symrig::hal
