// SPDX-License-Identifier: Apache-2.0
#include "wake.hpp"

#include "clock.hpp"

#include <algorithm>
#include <cstdint>

#include <sys/eventfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

namespace symrig::board_linux {

Alarm::Alarm() : fd_(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)) {}

void Alarm::set(hal::Tick tick) const {
  itimerspec spec{};
  if (tick != hal::kNever) {
    const hal::Tick at = std::max<hal::Tick>(tick, 1);  // 0 would disarm it
    spec.it_value.tv_sec = static_cast<time_t>(at / kTickHz);
    spec.it_value.tv_nsec = static_cast<long>(at % kTickHz);
  }
  ::timerfd_settime(fd_.get(), TFD_TIMER_ABSTIME, &spec, nullptr);
}

Bell::Bell() : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

void Bell::ring() const {
  const std::uint64_t one = 1;
  // A failed write means that the counter is full, so the bell rings anyway.
  [[maybe_unused]] const ssize_t written = ::write(fd_.get(), &one, sizeof one);
}

void Bell::quiet() const {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t got = ::read(fd_.get(), &count, sizeof count);
}

}  // namespace symrig::board_linux
