// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/probe.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
namespace {

Result<void> check_values(const Pattern& pattern, std::size_t number) {
  const auto values = pattern.values();
  const auto bad = std::find_if(values.begin(), values.end(), [](float v) { return !(v >= 0 && v <= 1); });
  if (bad == values.end()) return {};
  const auto at = static_cast<std::int64_t>(bad - values.begin());
  return Error{ErrorCode::bad_value,
               fmt::format("pattern {} is {} at row {}, column {}", number, *bad, at / pattern.grid().cols,
                           at % pattern.grid().cols),
               "give values from 0 to 1"};
}

}  // namespace

Result<void> check_aligned(const Probe& probe) {
  if (probe.grid() == probe.camera_grid()) return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("the projector shows {} cells, but the camera has {} pixels",
                           to_string(probe.grid()), to_string(probe.camera_grid())),
               "register the camera with symrig calibrate, and give the registration"};
}

Result<void> check_patterns(const Probe& probe, std::span<const Pattern> patterns) {
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    if (patterns[i].grid() != probe.grid() || patterns[i].channels() != 1)
      return Error{
          ErrorCode::size_mismatch,
          fmt::format("pattern {} is {} with {} channels, but this rig needs {} with 1", i,
                      to_string(patterns[i].grid()), patterns[i].channels(), to_string(probe.grid())),
          "give patterns on the rig's grid"};
    SYMRIG_CHECK(check_values(patterns[i], i));
  }
  return {};
}

}  // namespace symrig
