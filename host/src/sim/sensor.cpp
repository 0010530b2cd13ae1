// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor.hpp"

#include "sim/hash.hpp"
#include "sim/variates.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::sim {

namespace {

/// Maps 32 bits to the middle of one of 2³² equal cells of (0, 1).
double open_unit(std::uint32_t bits) {
  return (static_cast<double>(bits) + 0.5) * 0x1p-32;
}

std::uint16_t code_of(const NoiseModel& noise, double electrons, double z) {
  const double held = std::min(electrons, noise.full_well());
  const double code = noise.pedestal() + noise.gain() * (held + noise.read_noise() * z);
  return static_cast<std::uint16_t>(
      std::clamp(std::floor(code + 0.5), 0.0, static_cast<double>(noise.max_code())));
}

}  // namespace

void Sensor::expose(std::span<const float> radiance, double seconds, std::uint64_t frame,
                    std::span<std::uint16_t> codes, std::uint64_t first) const {
  const std::uint64_t key = combine(combine(0x5e4504, seed), frame);
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    const std::uint64_t bits = combine(key, first + i);
    const double mean = sensitivity * seconds * static_cast<double>(radiance[i]);
    const auto electrons = poisson_quantile(mean, open_unit(static_cast<std::uint32_t>(bits >> 32U)));
    const double z = normal_quantile(open_unit(static_cast<std::uint32_t>(bits)));
    codes[i] = code_of(noise, static_cast<double>(electrons), z);
  }
}

}  // namespace symrig::sim
