// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::sim {

/// A linear image sensor in front of a radiance.
///
///   electrons ~ Poisson(sensitivity · radiance · t), clipped at the full well
///   code = round(pedestal + gain (electrons + read noise · z)), clipped to [0, max code],  z ~ N(0, 1)
///
/// Every draw is a function of (seed, frame, pixel) alone: frames can be exposed in any order, on any number
/// of threads, and come out the same.  source: the noise model of hdr/noise_model.hpp.
struct Sensor {
  NoiseModel noise;
  double sensitivity;  ///< electrons per second at radiance 1
  std::uint64_t seed;

  /// radiance: channels × grid values; codes: as many. seconds > 0.
  void expose(std::span<const float> radiance, double seconds, std::uint64_t frame,
              std::span<std::uint16_t> codes) const;
};

}  // namespace symrig::sim
