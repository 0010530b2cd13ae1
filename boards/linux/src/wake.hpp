// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/hal/types.hpp"

namespace symrig::board_linux {

/// Readable from an absolute moment of CLOCK_MONOTONIC on. Armed in absolute time, so that nothing that
/// happens between reading the clock and going to sleep makes it late; and no timer slack, as poll() has.
class Alarm {
 public:
  Alarm();
  int fd() const { return fd_.get(); }
  bool ok() const { return static_cast<bool>(fd_); }
  /// kNever: never. A moment that has gone by: at once.
  void set(hal::Tick tick) const;

 private:
  Fd fd_;
};

/// Readable after ring(), until quieted. Any thread may ring.
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
