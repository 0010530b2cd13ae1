// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/clock_map.hpp"

#include <chrono>
#include <cmath>

namespace symrig::camera {
namespace {

// Half of it is the error of the offset: well below the ledger's tolerance for stamps.
constexpr Nanoseconds kLongestLatch = std::chrono::microseconds(200);

}  // namespace

Nanoseconds monotonic_now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

bool ClockMap::latch(Features& features) {
  const std::string command = features.first_of({"TimestampLatch", "GevTimestampControlLatch"});
  const std::string value = features.first_of({"TimestampLatchValue", "GevTimestampValue"});
  if (command.empty() || value.empty()) return false;
  for (int k = 0; k < 4; ++k) {
    const Nanoseconds before = monotonic_now();
    if (!features.execute(command)) return false;
    const Nanoseconds took = monotonic_now() - before;
    if (took > kLongestLatch) continue;
    const auto ticks = features.integer(value);
    if (!ticks) return false;
    double tick = 1;  // newer cameras count nanoseconds
    if (value == "GevTimestampValue") {
      const auto rate = features.integer("GevTimestampTickFrequency");
      if (!rate || *rate <= 0) return false;
      tick = 1e9 / static_cast<double>(*rate);
    }
    offset_ = before + took / 2 - Nanoseconds(std::llround(static_cast<double>(*ticks) * tick));
    return true;
  }
  return false;
}

std::optional<SteadyTime> ClockMap::host(std::uint64_t at) const {
  if (!offset_ || at == 0) return {};
  return SteadyTime{Nanoseconds(static_cast<std::int64_t>(at)) + *offset_};
}

}  // namespace symrig::camera
