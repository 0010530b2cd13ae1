// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/hash.hpp"

#include <cstdint>

namespace symrig::sim::drawn {

/// Random numbers from a key: a counter that is hashed. Only integers and exact float operations, so the
/// numbers are the same on all computers.
class Draws {
 public:
  explicit Draws(std::uint64_t key) : key_(key) {}

  std::uint64_t key() { return combine(key_, next_++); }
  double unit() { return unit_double(key()); }
  double between(double low, double high) { return low + (high - low) * unit(); }
  bool chance(double probability) { return unit() < probability; }
  /// 0 … count − 1.
  int below(int count) { return static_cast<int>(unit() * count); }
  /// Between `low` and low · 2^octaves, each octave equally probable.
  double octaves(double low, int octaves) {
    const int octave = below(octaves);
    return low * static_cast<double>(1 << octave) * (1 + unit());
  }

 private:
  std::uint64_t key_;
  std::uint64_t next_ = 0;
};

}  // namespace symrig::sim::drawn
