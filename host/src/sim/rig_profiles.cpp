// SPDX-License-Identifier: Apache-2.0
// The table of rig profiles. A new profile is a line of the table, and a row in docs/command-line.md.
#include "sim/rig_profiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace symrig::sim {
namespace {

// A camera of N frames a second without overlap: the next exposure begins 1/N s after the last one ends.
constexpr std::array kProfiles{
    RigProfile{"standard", "a 60 Hz projector, and a camera that reads out in 4 ms", 60, 1e-3, 4e-3, 1},
    RigProfile{"screen60", "a 60 Hz screen, and a camera of 60 frames a second", 60, 1e-3, 1.0 / 60, 1},
    RigProfile{"video", "a projector of 1,440 binary patterns a second, and a camera of 200 frames a second",
               1440, 1e-5, 5e-3, 1},
    RigProfile{"dlpc350",
               "24 bit planes in each picture of a 60 Hz screen, and a camera of 200 frames a second", 60,
               1e-5, 5e-3, 1, 24},
    RigProfile{"dlpc350-overlap", "as dlpc350, and the camera exposes while it reads out the last frame", 60,
               1e-5, 5e-3, 1, 24, true},
    RigProfile{"dlpc350-fast", "as dlpc350-overlap, with a camera of 700 frames a second", 60, 1e-5,
               1.0 / 700, 1, 24, true},
    RigProfile{"dim", "as screen60 with a tenth of the light", 60, 1e-3, 1.0 / 60, 0.1},
};

Nanoseconds duration(double seconds) {
  return Nanoseconds{std::llround(1e9 * seconds)};
}

}  // namespace

const RigProfile& profile_of(const SceneUri& uri) {
  const auto* found = std::find_if(kProfiles.begin(), kProfiles.end(),
                                   [&uri](const RigProfile& one) { return one.name == uri.profile; });
  return found == kProfiles.end() ? kProfiles.front() : *found;
}

double transmission_of(const SceneUri& uri) {
  return uri.light * profile_of(uri).light;
}

RigSetup setup_of(const RigProfile& profile) {
  RigSetup setup = default_rig_setup();
  setup.camera.readout = duration(profile.readout_seconds);
  setup.camera.overlap = profile.overlap;
  setup.camera.overlap_time_max = profile.overlap ? setup.camera.readout : Nanoseconds{0};
  setup.projector.refresh = duration(1 / profile.refresh_hz);
  setup.projector.vsync_timeout = duration(3 / profile.refresh_hz);
  setup.projector.settle = duration(profile.settle_seconds);
  if (profile.planes == 0) return setup;
  RigLine plane;
  plane.config.line = kPlaneLine;
  plane.role = RigRole::plane;
  setup.lines.push_back(plane);
  return setup;
}

CameraTiming timing_of(const RigProfile& profile) {
  CameraTiming timing;
  timing.readout = std::min(timing.readout, duration(profile.readout_seconds));
  return timing;
}

}  // namespace symrig::sim

namespace symrig {

std::span<const RigProfile> rig_profiles() {
  return sim::kProfiles;
}

}  // namespace symrig
