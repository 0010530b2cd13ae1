// SPDX-License-Identifier: Apache-2.0
#include "projector/dlp/plane_sequence.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::projector::dlp {
namespace {

/// A source may be this much faster than its mode says.
constexpr double kFastSource = 1e-3;

}  // namespace

Result<std::uint32_t> longest_period(int planes, Nanoseconds refresh, const PlaneLimits& limits) {
  const double room = 1e-3 * static_cast<double>(refresh.count()) * (1 - kFastSource) - limits.load;
  const double period = std::floor(room / planes);
  if (period >= limits.exposure) return static_cast<std::uint32_t>(period);
  return Error{ErrorCode::limit,
               fmt::format("{} planes do not fit into a refresh of {:.3f} ms: each takes {} us at least",
                           planes, 1e3 * seconds(refresh), limits.exposure),
               fmt::format("give at most {} planes, or a slower mode",
                           std::max(0, static_cast<int>(room / limits.exposure)))};
}

Result<void> check_sequence(const Sequence& sequence, Nanoseconds refresh, const PlaneLimits& limits) {
  if (sequence.planes < 1 || sequence.planes > kMostPlanes)
    return Error{ErrorCode::bad_argument, fmt::format("a picture has no {} planes", sequence.planes),
                 fmt::format("give 1 to {}", kMostPlanes)};
  if ((sequence.leds & kAllLeds) == 0)
    return Error{ErrorCode::bad_argument, "no LED is selected", "select red, green or blue"};
  if (sequence.exposure_us < limits.exposure)
    return Error{ErrorCode::limit,
                 fmt::format("a plane of {} us is too short for the controller", sequence.exposure_us),
                 fmt::format("give at least {} us", limits.exposure)};
  const bool whole = sequence.exposure_us == sequence.period_us;
  if (!whole && sequence.period_us < sequence.exposure_us + limits.load)
    return Error{ErrorCode::limit,
                 fmt::format("a plane of {} us every {} us leaves no time to load the next one",
                             sequence.exposure_us, sequence.period_us),
                 fmt::format("give a period of {} us, or of {} us and more", sequence.exposure_us,
                             sequence.exposure_us + limits.load)};
  SYMRIG_TRY(const std::uint32_t most, longest_period(sequence.planes, refresh, limits));
  if (sequence.period_us <= most) return {};
  return Error{ErrorCode::limit,
               fmt::format("{} planes of {} us do not fit into a refresh of {:.3f} ms", sequence.planes,
                           sequence.period_us, 1e3 * seconds(refresh)),
               fmt::format("give a period of at most {} us", most)};
}

Result<Sequence> sequence_of(const PlaneOptions& options, Nanoseconds refresh, const PlaneLimits& limits) {
  Sequence sequence{options.planes, 0, 0, options.leds};
  if (options.period_us) {
    sequence.period_us = *options.period_us;
  } else if (options.planes >= 1 && options.planes <= kMostPlanes) {
    SYMRIG_TRY(sequence.period_us, longest_period(options.planes, refresh, limits));
  }
  sequence.exposure_us = options.exposure_us.value_or(sequence.period_us);
  SYMRIG_CHECK(check_sequence(sequence, refresh, limits));
  return sequence;
}

}  // namespace symrig::projector::dlp
