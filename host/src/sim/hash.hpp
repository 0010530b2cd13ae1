// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace symrig::sim {

/// A bijection of 64 bits in which every input bit affects every output bit: two rounds of xor-shift and odd
/// multiplication, the finaliser of the splitmix family [Steele14]. Uses only integers, so results are equal
/// on all computers.
constexpr std::uint64_t mix(std::uint64_t x) {
  x ^= x >> 30U;
  x *= 0xbf58476d1ce4e5b9ULL;
  x ^= x >> 27U;
  x *= 0x94d049bb133111ebULL;
  x ^= x >> 31U;
  return x;
}

/// Makes one key from two, for counters such as (seed, row, column).
constexpr std::uint64_t combine(std::uint64_t key, std::uint64_t counter) {
  return mix(key + 0x9e3779b97f4a7c15ULL * (counter + 1));
}

/// The upper 24 bits as a float in [0, 1). Exact on all computers.
constexpr float unit_float(std::uint64_t bits) {
  return static_cast<float>(bits >> 40U) * 0x1p-24F;
}

/// The upper 53 bits as a double in [0, 1).
constexpr double unit_double(std::uint64_t bits) {
  return static_cast<double>(bits >> 11U) * 0x1p-53;
}

}  // namespace symrig::sim
