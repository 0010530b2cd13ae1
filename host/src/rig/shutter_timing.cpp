// SPDX-License-Identifier: Apache-2.0
#include "rig/shutter_timing.hpp"

#include <algorithm>

namespace symrig::rig {
namespace {

constexpr Nanoseconds kRounding{1'000};    // of an exposure and a gap to the board's ticks
constexpr Nanoseconds kLeastGap{100'000};  // between two pulses, so that a camera sees the first one end

}  // namespace

void adopt_timing(RigOptions& options, const CameraTiming& timing) {
  CameraProfile& camera = options.setup.camera;
  const Nanoseconds longer = std::max(Nanoseconds{0}, timing.readout - camera.readout);
  camera.readout += longer;
  if (options.gap) *options.gap += longer;
  camera.trigger_delay = std::max(camera.trigger_delay, timing.trigger_delay);
  if (timing.overlap.count() == 0) return;
  camera.overlap_time_max =
      camera.overlap ? std::max(camera.overlap_time_max, timing.overlap) : timing.overlap;
  camera.overlap = true;
}

Nanoseconds gap_without_overlap(const RigOptions& options) {
  return options.gap.value_or(options.setup.camera.readout);
}

Nanoseconds longest_overlap(const RigOptions& options) {
  const CameraProfile& camera = options.setup.camera;
  if (!camera.overlap) return Nanoseconds{0};
  const Nanoseconds gap = gap_without_overlap(options);
  const Nanoseconds until_ready = camera.overlap_time_max + gap - camera.readout;
  return std::max(Nanoseconds{0}, std::min(gap - kLeastGap, until_ready));
}

Nanoseconds overlap_before(Nanoseconds exposure, Nanoseconds longest) {
  return std::clamp(exposure - kRounding, Nanoseconds{0}, longest);
}

}  // namespace symrig::rig
