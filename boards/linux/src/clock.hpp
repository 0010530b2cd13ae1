// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/hal/clock.hpp"

#include <cstdint>
#include <ctime>
#include <span>

#include <poll.h>

namespace symrig::board_linux {

inline constexpr std::uint64_t kTickHz = 1'000'000'000;  ///< one tick is one nanosecond
inline constexpr hal::Tick kMicrosecond = 1'000;
inline constexpr hal::Tick kMillisecond = 1'000'000;

/// Nanoseconds of CLOCK_MONOTONIC, which the kernel uses to stamp edges. Async-signal-safe.
inline hal::Tick monotonic_now() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<hal::Tick>(now.tv_sec) * kTickHz + static_cast<hal::Tick>(now.tv_nsec);
}

class KernelClock final : public hal::Clock {
 public:
  hal::Tick now() const override { return monotonic_now(); }
};

/// Sleeps until an absolute moment of CLOCK_MONOTONIC. Two timers end the sleep, because each is late where
/// the other is not:
/// - A timer descriptor has an absolute time, which events between reading the clock and going to sleep do
/// not
///   delay, and no slack for threads of ordinary priority. But with PREEMPT_RT a thread of low priority makes
///   it readable.
/// - The timeout of ppoll(): with PREEMPT_RT the timer's interrupt itself wakes a thread with real-time
/// priority.
class Alarm {
 public:
  Alarm();
  bool ok() const { return static_cast<bool>(fd_); }
  /// Sleeps until `tick` or until one of `fds` is ready, and fills in their `revents`. The first place of
  /// `fds` is the alarm's own. kNever: no moment. A past moment: returns at once.
  void wait(hal::Tick tick, std::span<pollfd> fds) const;

 private:
  void set(hal::Tick tick) const;

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
