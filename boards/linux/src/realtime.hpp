// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>

#include <pthread.h>

namespace symrig::board_linux {

/// A mutex that lends its holder the priority of whoever waits for it: the main loop, holding it, is not
/// pushed aside by something in between while the player waits.
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

/// Gives the calling thread SCHED_FIFO. Empty: done; else what is in the way, and what to do about it.
std::string run_first(int priority);
/// Keeps all memory of the process in RAM. Empty: done; else what is in the way.
std::string lock_memory();

}  // namespace symrig::board_linux
