// SPDX-License-Identifier: Apache-2.0
// Numbers to try in the place of a good one.
#pragma once

#include "symrig/base/random.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace symrig::structured {

inline std::uint64_t below(Random& random, std::uint64_t n) {
  return n == 0 ? 0 : random.bits() % n;
}

template <class T>
const T& any_of(Random& random, const std::vector<T>& choices) {
  return choices[below(random, choices.size())];
}

/// An extreme, a neighbour of the old value, or anything.
inline std::int64_t other_integer(Random& random, std::int64_t old) {
  constexpr std::int64_t kInt = std::numeric_limits<std::int32_t>::max();
  constexpr std::int64_t kLong = std::numeric_limits<std::int64_t>::max();
  static const std::vector<std::int64_t> extremes{0,
                                                  1,
                                                  -1,
                                                  2,
                                                  3,
                                                  7,
                                                  63,
                                                  64,
                                                  255,
                                                  256,
                                                  1024,
                                                  1 << 15,
                                                  1 << 16,
                                                  1 << 24,
                                                  1 << 30,
                                                  kInt,
                                                  -kInt - 1,
                                                  kInt + 1,
                                                  std::int64_t{1} << 32,
                                                  std::int64_t{1} << 62,
                                                  kLong,
                                                  -kLong - 1};
  switch (below(random, 4)) {
    case 0:
      return any_of(random, extremes);
    case 1:
      return static_cast<std::int64_t>(static_cast<std::uint64_t>(old) + below(random, 5) - 2);
    case 2:
      return static_cast<std::int64_t>(below(random, 64)) - 4;
    default:
      return static_cast<std::int64_t>(random.bits()) >> below(random, 64);
  }
}

inline double other_real(Random& random, double old) {
  static const std::vector<double> extremes{0.0,
                                            -0.0,
                                            1.0,
                                            -1.0,
                                            std::numeric_limits<double>::quiet_NaN(),
                                            std::numeric_limits<double>::infinity(),
                                            -std::numeric_limits<double>::infinity(),
                                            std::numeric_limits<double>::max(),
                                            static_cast<double>(std::numeric_limits<float>::max()),
                                            -static_cast<double>(std::numeric_limits<float>::max()),
                                            static_cast<double>(std::numeric_limits<float>::denorm_min()),
                                            65504.0,
                                            0x1p60,
                                            0x1p59,
                                            1e-30};
  switch (below(random, 4)) {
    case 0:
      return any_of(random, extremes);
    case 1:
      return -old;
    case 2:
      return old * (1 + random.uniform());
    default:
      return std::bit_cast<double>(random.bits());
  }
}

}  // namespace symrig::structured
