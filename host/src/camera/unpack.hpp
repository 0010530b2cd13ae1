// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/pixel_format.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace symrig::camera {

/// Where the sample lies in its word.
struct SampleDepth {
  int bits = 16;  ///< of a sample
  int shift = 0;  ///< unused bits below the sample
};

/// How many samples form a group in memory. Reading a row can start at a multiple of this number.
int group_samples(Packing packing);

/// Reads the first codes.size() samples of `row`, which has at least row_bytes() bytes: code = word >> shift,
/// at most 2^bits − 1. Returns the OR of all words. A bit outside the sample shows that the depth is wrong.
std::uint16_t unpack(Packing packing, SampleDepth depth, std::span<const std::byte> row,
                     std::span<std::uint16_t> codes);

}  // namespace symrig::camera
