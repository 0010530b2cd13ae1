// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/pixel_format.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace symrig::camera {

/// Where the sample stands in its word.
struct SampleDepth {
  int bits = 16;  ///< of a sample
  int shift = 0;  ///< bits below it
};

/// Samples that stand together in memory: a row can be entered at a multiple of it.
int group_samples(Packing packing);

/// The first codes.size() samples of `row` (row_bytes() of them at least): code = word >> shift, at most
/// 2^bits − 1. Returns all bits that any word had: what lies outside of the sample belies the depth.
std::uint16_t unpack(Packing packing, SampleDepth depth, std::span<const std::byte> row,
                     std::span<std::uint16_t> codes);

}  // namespace symrig::camera
