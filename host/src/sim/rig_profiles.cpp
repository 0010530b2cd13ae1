// SPDX-License-Identifier: Apache-2.0
// The table of rig profiles. A new profile is a line of the table, and a row in docs/command-line.md.

#include "sim/rig_profiles.hpp"

#include "sim/image_formation.hpp"
#include "symrig/rig/frame_reading.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace symrig::sim {

namespace {

/// Reads frames of a simulated camera without noise. Their attachment is the mean radiance during the
/// exposure (ImageFormation::Light), instead of codes. The photograph is exactly this light.
class ExactFrames final : public FrameReading {
 public:
  std::optional<double> brightest_rate(const CameraFrame& frame, Nanoseconds exposure, const Camera& camera,
                                       double scale) const override;
  /// The light of the last frame, with variance 0.
  /// fails: frame_missing (the frame carries no light).
  Result<Radiance> photograph(std::span<const CameraFrame> frames, std::span<const Nanoseconds> exposures,
                              const Camera& camera, const PhotographUnits& units) const override;
  std::string contradicted_exposures(std::span<const CameraFrame> /*frames*/,
                                     std::span<const Nanoseconds> /*exposures*/,
                                     const NoiseModel& /*noise*/) const override {
    return "";
  }
  bool exact() const override { return true; }
};

/// nullptr: the frame carries no light.
ImageFormation::Light light_of(const CameraFrame& frame) {
  const auto* light = std::any_cast<ImageFormation::Light>(&frame.attachment);
  return light == nullptr ? nullptr : *light;
}

std::optional<double> ExactFrames::brightest_rate(const CameraFrame& frame, Nanoseconds /*exposure*/,
                                                  const Camera& camera, double scale) const {
  const ImageFormation::Light light = light_of(frame);
  if (light == nullptr) return std::nullopt;
  return largest_live(light->values(), camera) / scale;
}

Result<Radiance> ExactFrames::photograph(std::span<const CameraFrame> frames,
                                         std::span<const Nanoseconds> /*exposures*/, const Camera& camera,
                                         const PhotographUnits& units) const {
  const ImageFormation::Light seen = light_of(frames.back());
  if (seen == nullptr)
    return Error{ErrorCode::frame_missing, fmt::format("frame {} has no light", frames.back().sequence),
                 "take the photograph again"};
  Radiance radiance{*seen, Image<float>(seen->grid(), seen->channels()),
                    Image<std::uint8_t>(seen->grid(), seen->channels(), 1)};
  for (float& value : radiance.mean.values()) value *= static_cast<float>(1 / units.lamp);
  const Image<std::uint8_t>* dead = camera.dead();
  if (dead == nullptr) return radiance;
  for (int c = 0; c < seen->channels(); ++c) {
    for (std::size_t i = 0; i < dead->values().size(); ++i) {
      if (dead->values()[i] == 0) continue;
      radiance.mean.plane(c)[i] = 0;
      radiance.valid.plane(c)[i] = 0;
    }
  }
  return radiance;
}

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
  return uri.light * profile_of(uri).light / (uri.given ? uri.given->white : 1);
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
