// SPDX-License-Identifier: Apache-2.0
#include "tick_duration.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace symrig::apps {

std::string tick_duration_text(TickRate rate, Ticks ticks) {
  struct Unit {
    double seconds;
    const char* name;
  };
  constexpr std::array<Unit, 4> kUnits{{{1, "s"}, {1e-3, "ms"}, {1e-6, "us"}, {1e-9, "ns"}}};
  const double seconds = static_cast<double>(ticks.count) / static_cast<double>(rate.hz);
  const auto* unit =
      std::find_if(kUnits.begin(), kUnits.end(), [=](const Unit& one) { return seconds >= one.seconds; });
  if (unit == kUnits.end()) unit = &kUnits.back();
  return fmt::format("{:.4g} {}", seconds / unit->seconds, unit->name);
}

}  // namespace symrig::apps
