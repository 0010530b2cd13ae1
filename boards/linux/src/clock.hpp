// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/clock.hpp"

#include <cstdint>
#include <ctime>

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

}  // namespace symrig::board_linux
