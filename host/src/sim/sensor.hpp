// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::sim {

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

}  // namespace symrig::sim
