// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gpio.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

#include <pthread.h>

namespace symrig::board_linux {

/// A mutex with priority inheritance. While the player waits for it, its holder (the main loop) runs at the
/// player's priority, so that no thread in between delays it.
class PriorityMutex {
 public:
  PriorityMutex();
  ~PriorityMutex() { pthread_mutex_destroy(&mutex_); }
  PriorityMutex(const PriorityMutex&) = delete;
  PriorityMutex& operator=(const PriorityMutex&) = delete;

  void lock() { pthread_mutex_lock(&mutex_); }
  void unlock() { pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_{};
};
using PriorityLock = std::scoped_lock<PriorityMutex>;

/// Gives the calling thread SCHED_FIFO. Returns an empty text, or the obstacle and how to remove it.
std::string run_first(int priority);
/// Keeps all processors out of sleep states that take longer than a microsecond to leave, until the
/// descriptor is closed (Linux: PM QoS, /dev/cpu_dma_latency). fails: device_refused, with the obstacle.
Result<Fd> stay_awake();
/// Locks all memory of the process in RAM. Returns an empty text, or the obstacle and how to remove it.
std::string lock_memory();

/// Sends a state such as "READY=1" to systemd, if systemd has started this process (sd_notify(3): a datagram
/// to $NOTIFY_SOCKET).
void notify_manager(std::string_view state);

/// Writes one line to the log: standard error, which systemd stores in its journal.
void log_line(std::string_view text);

/// Sets the outputs to their safe levels if the process crashes: SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT
/// (including std::terminate). It cannot help against SIGKILL, a stopped kernel, or power loss.
class Emergency {
 public:
  /// Active until it is destroyed. Only one may exist at a time. gpio must outlive it.
  explicit Emergency(Gpio& gpio);
  ~Emergency();
  Emergency(const Emergency&) = delete;
  Emergency& operator=(const Emergency&) = delete;

  static void set_safe(std::uint32_t levels);
};

}  // namespace symrig::board_linux
