// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/view.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/image.hpp"
#include "symrig/sim/scene.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace symrig::sim {

/// Faults of the camera's optics and sensor. The default is none.
struct CameraFaults {
  double misalign = 0;  ///< pixels: (row, col) shows the light of (row + misalign, col + misalign)
  double flare = 0;     ///< share of the light that a broad one-sided flare spreads
  double dead = 0;      ///< share of dead pixels
};

/// Shifts a plane by bilinear interpolation. Pixels from outside the grid are dark.
void shift(Grid grid, double pixels, std::span<float> plane);

/// plane ← (1 − share) plane + share · K plane. K spreads light down and to the right with an exponential
/// profile whose length is a tenth of the longer side. The projector has no such flare, so the measured T is
/// not symmetric. Light that leaves the picture is lost.
void add_flare(Grid grid, double share, std::span<float> plane);

/// 1 for each dead pixel: `share` of the pixels on average, seeded. Empty if share is 0.
Image<std::uint8_t> dead_pixels(Grid grid, double share, std::uint64_t key);

/// A linear image sensor.
///
///   electrons ~ Poisson(sensitivity · radiance · t), clipped at the full well
///   code = round(pedestal + gain (electrons + read noise · z)), clipped to [0, max code],  z ~ N(0, 1)
///
/// Every random value depends only on (seed, frame, pixel). So frames may be exposed in any order and on any
/// number of threads, with the same result.
/// source: the noise model of hdr/noise_model.hpp.
struct Sensor {
  NoiseModel noise;
  double sensitivity;  ///< electrons per second at radiance 1
  std::uint64_t seed;

  /// radiance: some of channels × grid values; codes: the same number. first: index of the first one among
  /// all values of the frame. seconds > 0.
  void expose(std::span<const float> radiance, double seconds, std::uint64_t frame,
              std::span<std::uint16_t> codes, std::uint64_t first = 0) const;
};

/// A white wall saturates the sensor in 2 ms. For bright scenes the shortest exposure is close to that, so a
/// bracket of four at ratio 8 ends near one second.
inline constexpr double kSensitivity = 1e7;

/// Computes the camera's codes from the projected patterns: scene, faults of the optics, lamp, sensor. Has no
/// clock and no device: the caller says how long each pattern was lit. Thread-safe.
class ImageFormation {
 public:
  using Light = std::shared_ptr<const Image<float>>;
  /// Light that was on for a share of an exposure, 0 to 1.
  struct Share {
    Light light;
    double share = 0;
  };

  /// view must outlive this object.
  ImageFormation(const SceneUri& uri, const CameraView& view);

  /// Radiance on the sensor while a pattern is lit: lamp · flare(shift(see(p) + see(black))).
  /// shown_before: number of patterns shown before, for the drift of the lamp.
  Light light_of(const Image<float>& pattern, std::uint64_t shown_before) const;
  /// Mean radiance of an exposure: Σ share · light. The screen is dark for the rest, up to 1.
  Light during(std::span<const Share> shares) const;
  /// The codes in one tile of frame number `frame`, for this exposure time (> 0). Equal arguments give equal
  /// codes, whatever the tile.
  std::vector<std::uint16_t> expose(const Image<float>& light, double seconds, std::uint64_t frame,
                                    const Tile& tile) const;
  /// The same of the whole frame.
  std::vector<std::uint16_t> expose(const Image<float>& light, double seconds, std::uint64_t frame) const {
    return expose(light, seconds, frame, Tile{0, 0, light.grid()});
  }

  Grid cells() const { return cells_; }
  Grid camera() const { return view_.camera(); }
  const NoiseModel& noise() const { return sensor_.noise; }
  /// Radiance of one electron per second, behind the filter.
  double scale() const { return 1 / sensor_.sensitivity; }

 private:
  Image<float> projected(const Image<float>& pattern) const;

  const CameraView& view_;
  Grid cells_;
  double gamma_;
  float black_;
  double misalign_;
  double flare_;
  double drift_;
  Sensor sensor_;
  Image<float> leak_;  // the light of the projector's black level; empty: none, or the view changes
};

}  // namespace symrig::sim
