// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/hal/types.hpp"

namespace symrig::board_linux {

/// Readable from an absolute moment of CLOCK_MONOTONIC on. An absolute time is not delayed by events between
/// reading the clock and going to sleep. Unlike poll(), it has no timer slack.
class Alarm {
 public:
  Alarm();
  int fd() const { return fd_.get(); }
  bool ok() const { return static_cast<bool>(fd_); }
  /// kNever: never. A past moment: at once.
  void set(hal::Tick tick) const;

 private:
  Fd fd_;
};

/// Readable after ring(), until it is reset. Any thread may ring.
class Bell {
 public:
  Bell();
  int fd() const { return fd_.get(); }
  bool ok() const { return static_cast<bool>(fd_); }
  void ring() const;
  void quiet() const;

 private:
  Fd fd_;
};

}  // namespace symrig::board_linux
