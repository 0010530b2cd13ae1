// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/image_formation.hpp"
#include "symrig/rig/frame_reading.hpp"

namespace symrig::sim {

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

}  // namespace symrig::sim
