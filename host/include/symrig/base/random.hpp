// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace symrig {

/// A small random generator, SplitMix64 (Steele, Lea, Flood, OOPSLA 2014). It gives the same numbers on every
/// machine.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(seed) {}

  constexpr std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15U);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31);
  }
  /// Uniform in [0, 1), 53 bits.
  constexpr double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  /// −1 or +1.
  constexpr float sign() { return (bits() >> 63) != 0 ? 1.0F : -1.0F; }

 private:
  std::uint64_t state_;
};

}  // namespace symrig
