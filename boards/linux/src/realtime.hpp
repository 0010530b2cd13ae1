// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/base/result.hpp"

#include <mutex>
#include <string>

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

}  // namespace symrig::board_linux
