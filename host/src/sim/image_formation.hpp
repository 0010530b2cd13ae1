// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/sensor.hpp"
#include "sim/view.hpp"
#include "symrig/image/image.hpp"
#include "symrig/sim/scene.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace symrig::sim {

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
  ImageFormation(const SceneUri& uri, const View& view);

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

  const View& view_;
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
