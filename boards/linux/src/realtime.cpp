// SPDX-License-Identifier: Apache-2.0
#include "realtime.hpp"

#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>

namespace symrig::board_linux {

PriorityMutex::PriorityMutex() {
  pthread_mutexattr_t attributes{};
  pthread_mutexattr_init(&attributes);
  pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  pthread_mutex_init(&mutex_, &attributes);
  pthread_mutexattr_destroy(&attributes);
}

std::string run_first(int priority) {
  sched_param wanted{};
  wanted.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
  if (error == 0) return {};
  return fmt::format("no real-time priority ({}); give the service LimitRTPRIO={} or CAP_SYS_NICE",
                     std::strerror(error), priority);
}

std::string lock_memory() {
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return fmt::format("memory is not locked ({}); give the service LimitMEMLOCK=infinity",
                     std::strerror(errno));
}

}  // namespace symrig::board_linux
