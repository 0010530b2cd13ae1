// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/image/image.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace symrig {

/// What converts the frames of one photograph to radiance.
struct PhotographUnits {
  double scale = 1;                 ///< radiance of one electron per second
  double lamp = 1;                  ///< the lamp's brightness, in units of the first reference photograph
  const Radiance* black = nullptr;  ///< dark projector, to subtract; nullptr: nothing
};

/// Converts the camera's frames to radiance. This class uses the camera's noise model. A rig with other
/// frames, such as a simulated camera without noise, has its own class. Several threads call it at the same
/// time.
class FrameReading {
 public:
  FrameReading() = default;
  FrameReading(const FrameReading&) = delete;
  FrameReading& operator=(const FrameReading&) = delete;
  virtual ~FrameReading() = default;

  /// Electrons per second of the brightest live pixel. None if it is saturated. The estimate is a few sigmas
  /// too high, because it is the largest of n noisy samples. This error is on the safe side.
  virtual std::optional<double> brightest_rate(const CameraFrame& frame, Nanoseconds exposure,
                                               const Camera& camera, double scale) const;
  /// Merges the frames of a bracket into one photograph.
  /// fails: as merge().
  virtual Result<Radiance> photograph(std::span<const CameraFrame> frames,
                                      std::span<const Nanoseconds> exposures, const Camera& camera,
                                      const PhotographUnits& units) const;
  /// Describes how the frames of a bracket contradict their exposure times, worst first. Empty: no
  /// contradiction, or no frame can show one.
  virtual std::string contradicted_exposures(std::span<const CameraFrame> frames,
                                             std::span<const Nanoseconds> exposures,
                                             const NoiseModel& noise) const;
  /// true: frames have no noise, so one frame is as good as several.
  virtual bool exact() const { return false; }
};

/// The largest value of a frame, without dead pixels. values: planes of the camera's grid.
template <class T>
double largest_live(std::span<const T> values, const Camera& camera) {
  const std::size_t pixels = camera.grid().size();
  const Image<std::uint8_t>* dead = camera.dead();
  double largest = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (dead == nullptr || dead->values()[i % pixels] == 0)
      largest = std::max(largest, static_cast<double>(values[i]));
  return largest;
}

}  // namespace symrig
