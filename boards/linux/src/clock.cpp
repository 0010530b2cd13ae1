// SPDX-License-Identifier: Apache-2.0
#include "clock.hpp"

#include <algorithm>
#include <cstdint>

#include <sys/eventfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

namespace symrig::board_linux {

Alarm::Alarm() : fd_(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)) {}

namespace {

timespec to_timespec(hal::Tick time) {
  return {static_cast<time_t>(time / kTickHz), static_cast<long>(time % kTickHz)};
}

}  // namespace

void Alarm::wait(hal::Tick tick, std::span<pollfd> fds) const {
  set(tick);
  fds[0] = {fd_.get(), POLLIN, 0};
  const hal::Tick now = monotonic_now();
  const timespec left = to_timespec(tick > now ? tick - now : 0);
  ::ppoll(fds.data(), fds.size(), tick == hal::kNever ? nullptr : &left, nullptr);
}

void Alarm::set(hal::Tick tick) const {
  itimerspec spec{};
  if (tick != hal::kNever) spec.it_value = to_timespec(std::max<hal::Tick>(tick, 1));  // 0 would disarm it
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
