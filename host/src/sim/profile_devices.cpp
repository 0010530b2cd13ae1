// SPDX-License-Identifier: Apache-2.0
#include "sim/exact_frames.hpp"
#include "sim/image_formation.hpp"
#include "sim/rig_profiles.hpp"

#include <algorithm>

namespace symrig::sim {

namespace {

constexpr Nanoseconds kClockMargin{10'000};  // of stamps that two clocks made

}  // namespace

RigOptions options_of(const SceneUri& uri) {
  RigOptions options;
  options.exposures = uri.exposures;
  options.ratio = uri.ratio;
  options.setup = setup_of(profile_of(uri));
  options.scale = 1 / (kSensitivity * transmission_of(uri));
  options.views = views_of(uri);
  options.name = uri.to_string();
  if (!uri.camera_noise) options.reading = std::make_shared<ExactFrames>();
  options.ledger.guards = 0;  // a camera in virtual time loses no frames at its start
  options.ledger.readout = std::min(options.ledger.readout, options.setup.camera.readout);
  // As in a rig file: exposures end so far apart that a stamp fits only one. Without overlap they do anyway.
  if (options.setup.camera.overlap)
    options.gap = options.setup.camera.readout + 2 * options.ledger.tolerance + kClockMargin;
  return options;
}

board_sim::SimProjectorConfig raster_of(const RigProfile& profile) {
  board_sim::SimProjectorConfig config;
  config.refresh_hz = static_cast<std::uint32_t>(profile.refresh_hz);
  return config;
}

board_sim::SimPlaneProjectorConfig planes_of(const RigProfile& profile) {
  board_sim::SimPlaneProjectorConfig config;
  config.refresh_hz = static_cast<std::uint32_t>(profile.refresh_hz);
  config.planes = profile.planes;
  config.plane_line = kPlaneLine;
  return config;
}

board_sim::SimBoardConfig board_of(const RigProfile& profile) {
  board_sim::SimBoardConfig config;
  if (profile.planes > 0) config.lines.push_back({kPlaneLine, false});
  return config;
}

/// The camera is ready a millisecond before the program expects it.
board_sim::SimCameraConfig shutter_of(const RigProfile& profile) {
  board_sim::SimCameraConfig config;
  config.readout_us = static_cast<std::uint64_t>(1e6 * profile.readout_seconds) - 1000;
  config.overlap = profile.overlap;
  return config;
}

}  // namespace symrig::sim
