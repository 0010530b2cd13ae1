// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/merge.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace symrig::test {

/// Counter-based random numbers (splitmix64 finaliser of a running counter): the same on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : counter_(seed * 0x9E3779B97F4A7C15ULL) {}

  /// Uniform in (0, 1).
  double uniform() {
    counter_ += 0x9E3779B97F4A7C15ULL;
    std::uint64_t z = counter_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return (static_cast<double>((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
  }
  /// Standard normal (Box and Muller).
  double normal() { return std::sqrt(-2 * std::log(uniform())) * std::cos(2 * std::numbers::pi * uniform()); }
  /// Poisson with this mean: exact by multiplication of uniforms below 60; above, a normal with the right
  /// skewness (mean exact, variance too large by 1/18).
  double poisson(double mean) {
    if (mean < 60) return small_poisson(mean);
    const double z = normal();
    return std::max(0.0, std::round(mean + std::sqrt(mean) * z + (z * z - 1) / 6));
  }

 private:
  double small_poisson(double mean) {
    const double limit = std::exp(-mean);
    double product = uniform();
    int n = 0;
    for (; product > limit; ++n) product *= uniform();
    return n;
  }

  std::uint64_t counter_;
};

/// One raw code of a pixel that collects `electrons` on average.
inline std::uint16_t sample(const NoiseModel& noise, double electrons, Random& random) {
  const double collected = std::min(random.poisson(electrons), noise.full_well());
  const double code = noise.pedestal() + noise.gain() * (collected + noise.read_noise() * random.normal());
  return static_cast<std::uint16_t>(std::clamp(std::round(code), 0.0, static_cast<double>(noise.max_code())));
}

/// A bracket of one uniform scene: exposures and their codes.
struct SimulatedBracket {
  std::vector<Nanoseconds> exposures;
  std::vector<std::vector<std::uint16_t>> codes;

  std::vector<Frame> frames() const {
    std::vector<Frame> result;
    for (std::size_t k = 0; k < codes.size(); ++k) result.push_back({codes[k], exposures[k]});
    return result;
  }
};

/// `count` exposures, each `ratio` times shorter than the one before, from `longest` on.
inline std::vector<Nanoseconds> exposure_ladder(int count, int ratio, Nanoseconds longest) {
  std::vector<Nanoseconds> result;
  for (int k = 0; k < count; ++k, longest /= ratio) result.push_back(longest);
  return result;
}

/// electrons_per_second: the true rate of every pixel.
inline SimulatedBracket photograph_uniform(const NoiseModel& noise, const std::vector<Nanoseconds>& exposures,
                                           double electrons_per_second, std::size_t pixels, Random& random) {
  SimulatedBracket bracket{exposures, {}};
  for (const Nanoseconds t : exposures) {
    std::vector<std::uint16_t> codes(pixels);
    for (auto& code : codes) code = sample(noise, electrons_per_second * seconds(t), random);
    bracket.codes.push_back(std::move(codes));
  }
  return bracket;
}

}  // namespace symrig::test
