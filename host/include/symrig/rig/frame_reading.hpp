// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/image/radiance.hpp"

#include <optional>
#include <span>
#include <string>

namespace symrig {

/// What turns the frames of one photograph into radiance, besides the frames.
struct PhotographUnits {
  double scale = 1;                 ///< radiance of one electron per second
  double lamp = 1;                  ///< brightness of the lamp, in units of the first reference photograph
  const Radiance* black = nullptr;  ///< the dark projector, subtracted; none: nothing is subtracted
};

/// How a rig reads its camera's frames. This class reads codes by the camera's noise model. A rig with other
/// frames (a simulated camera without noise) brings its own. Called by several threads at a time.
class FrameReading {
 public:
  FrameReading() = default;
  FrameReading(const FrameReading&) = delete;
  FrameReading& operator=(const FrameReading&) = delete;
  virtual ~FrameReading() = default;

  /// Electrons per second of the brightest live pixel. Nothing if it is saturated.
  /// The largest of n noisy samples lies a few sigmas high: the estimate errs to the safe side.
  virtual std::optional<double> brightest_rate(const CameraFrame& frame, Nanoseconds exposure,
                                               const Camera& camera, double scale) const;
  /// One photograph from the frames of its bracket.  fails: as merge().
  virtual Result<Radiance> photograph(std::span<const CameraFrame> frames,
                                      std::span<const Nanoseconds> exposures, const Camera& camera,
                                      const PhotographUnits& units) const;
  /// How the frames of a bracket contradict their exposures, worst first; empty: they do not, or nothing
  /// shows it.
  virtual std::string contradicted_exposures(std::span<const CameraFrame> frames,
                                             std::span<const Nanoseconds> exposures,
                                             const NoiseModel& noise) const;
  /// One frame has no noise: a photograph gains nothing from more.
  virtual bool exact() const { return false; }
};

}  // namespace symrig
