// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/sensor.hpp"
#include "symrig/image/image.hpp"
#include "symrig/sim/scene.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace symrig::sim {

/// A white wall fills the well in 2 ms: with the bright scenes' shortest exposure near that, a bracket
/// of four at ratio 8 ends near one second.
inline constexpr double kSensitivity = 1e7;

/// Between the projector's screen and the camera's codes: the scene, the optics' faults, the lamp, the
/// sensor. Knows no clock and no device; which pattern was lit for how long is told to it. Thread-safe.
class Studio {
 public:
  using Light = std::shared_ptr<const Image<float>>;
  /// Light that fell for a share of an exposure, 0 to 1.
  struct Share {
    Light light;
    double share = 0;
  };

  /// scene must outlive the studio.
  Studio(const SceneUri& uri, const Scene& scene);

  /// Radiance on the sensor while a pattern is lit: lamp · flare(shift(T p + black T 1)).
  /// shown_before: patterns shown before it; what lamp drift counts by.
  Light light_of(const Image<float>& pattern, std::uint64_t shown_before) const;
  /// Mean radiance of an exposure: Σ share · light. The dark makes up what is missing to 1.
  Light during(std::span<const Share> shares) const;
  /// The codes of frame number `frame`, exposed for this long (> 0). Equal arguments, equal codes.
  std::vector<std::uint16_t> expose(const Image<float>& light, double seconds, std::uint64_t frame) const;

  const NoiseModel& noise() const { return sensor_.noise; }
  /// Radiance of one electron a second, behind the filter.
  double scale() const { return 1 / sensor_.sensitivity; }
  const Scene& scene() const { return scene_; }

 private:
  Image<float> projected(const Image<float>& pattern) const;

  const Scene& scene_;
  double gamma_;
  double misalign_;
  double flare_;
  double drift_;
  Sensor sensor_;
  Image<float> leak_;  // what the projector's black level shows; empty without
};

}  // namespace symrig::sim
