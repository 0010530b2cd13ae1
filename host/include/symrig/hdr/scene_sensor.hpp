// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/hdr/sensor.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace symrig {

/// One light and one exposure of a still scene.
struct SceneLevel {
  bool lit = false;  ///< false: the projector is black, or the lens is capped
  Nanoseconds exposure{0};
};

/// What frames of a still scene tell besides the sensor.
struct SceneFacts {
  /// Dark current and stray light, mean of all pixels [DN/s]; 0: one dark level only.
  double dark_signal = 0;
  double dark_signal_sigma = 0;  ///< its standard error
  double drift = 0;              ///< the light at the end by that at the begin, less 1
  double flicker = 0;            ///< rms change of the light from frame to frame, share
  bool clipping_seen = false;    ///< false: no level saturates, and the largest code is taken for it
  Grid grid;
  std::int64_t dark_frames = 0, lit_frames = 0;
  int dark_levels = 0, lit_levels = 0;
};

/// A sensor that was measured with a still scene.
struct SceneSensor : SceneFacts {
  /// prnu is 0, and defects are those of dark frames: the scene is no even light. Empty: the noise does not
  /// grow with light, because the camera is not linear.
  std::optional<Sensor> sensor;
  Linearity linearity;
  std::optional<ResponseCurve> response;  ///< [Debevec97], unless the camera is linear
  double response_doubt = 0;              ///< largest difference from [Robertson99], share of full light
};

/// Measures a sensor from pairs of frames of any still scene in steady light. Frames pass through: memory is
/// about 20 bytes for each pixel, and one frame for each lit exposure.
///
/// The difference of two frames of one pixel has twice the variance of one frame, whatever the scene is. So
/// the scene need not be even. The first lit pair sorts the pixels into groups whose light differs by a
/// quarter at most. It is not used otherwise, because a choice by a frame's own noise would bias its
/// variance. Each later pair gives a point (mean, variance) for each group, and the line through all points
/// is that of measure_sensor [Janesick07]. The pedestal is that of dark frames, continued to an exposure of
/// 0. Pixels whose light is expected to be beyond the range show the code at which light clips.
///
/// Exposures are needed for the linearity, for the dark signal and for clipping. A scene does not tell how
/// the sensitivities of pixels differ (PRNU), or which pixels see no light.
class SceneTransfer {
 public:
  using Codes = std::span<const std::uint16_t>;

  SceneTransfer(Grid grid, int bits);
  ~SceneTransfer();
  SceneTransfer(SceneTransfer&&) noexcept;
  SceneTransfer& operator=(SceneTransfer&&) noexcept;

  /// The level of the pairs that follow. Dark levels come first, the shortest exposure before the others. The
  /// first lit level must be bright and mostly unsaturated. If a later one has the same exposure within 1 %,
  /// it tells the drift of the light.
  /// fails: bad_argument (order, exposure).
  Result<void> begin(const SceneLevel& level);
  /// Two frames, one directly after the other.
  /// fails: bad_argument (no level was begun), size_mismatch, bad_value (a code of more bits).
  Result<void> add(Codes first, Codes second);

  /// fails: bad_argument (no dark level of four frames, no lit level of two), limit (the light drifts by more
  /// than kMostDrift), bad_value (no light between dark and saturation; noise that does not grow with light;
  /// no two exposures to compare).
  Result<SceneSensor> finish();

  /// The light may change by this share: half of what would make a linear camera look wrong.
  static constexpr double kMostDrift = 0.02;

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace symrig
