// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace symrig::hdr {

/// The sums to which a frame is added, `count` values each.
struct StreamSums {
  float* sum;            ///< Σ d
  float* time;           ///< Σ t
  float* weighted_sum;   ///< Σ t d
  float* weighted_time;  ///< Σ t²
};

/// Adds the samples of one frame below `saturation`. Gives the same bits on every instruction set.
void add_frame(const std::uint16_t* raw, std::size_t count, float pedestal, float saturation, float t,
               const StreamSums& into) noexcept;

}  // namespace symrig::hdr
