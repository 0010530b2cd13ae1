// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

namespace symrig {

/// A duration in the host's arithmetic. Board time is in ticks, which are another type (board module).
using Nanoseconds = std::chrono::duration<std::int64_t, std::nano>;

constexpr double seconds(Nanoseconds t) {
  return 1e-9 * static_cast<double>(t.count());
}

}  // namespace symrig
