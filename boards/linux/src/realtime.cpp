// SPDX-License-Identifier: Apache-2.0
#include "realtime.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

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

Result<Fd> stay_awake() {
  constexpr const char* kPath = "/dev/cpu_dma_latency";
  constexpr std::int32_t kMicroseconds = 0;
  Fd file(::open(kPath, O_WRONLY | O_CLOEXEC));
  if (file && ::write(file.get(), &kMicroseconds, sizeof kMicroseconds) == sizeof kMicroseconds) return file;
  return Error{ErrorCode::device_refused,
               fmt::format("the processors may sleep deeply ({}: {})", kPath, std::strerror(errno)),
               "give the service this device (62-symrig-gpio.rules, DeviceAllow=)"};
}

std::string lock_memory() {
  if (::mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return fmt::format("memory is not locked ({}); give the service LimitMEMLOCK=infinity",
                     std::strerror(errno));
}

}  // namespace symrig::board_linux
