// SPDX-License-Identifier: Apache-2.0
// What the drivers of cameras share.
#pragma once

#include "symrig/base/internal/table_reader.hpp"
#include "symrig/camera/region.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>

namespace symrig::camera {

/// Maps the sensor's defects to pixels of the frames. A sum is dead if any of its samples is dead. Which
/// samples are summed depends on the mosaic, so every sample of the square counts. Empty: there are none.
Image<std::uint8_t> dead_pixels(const Image<std::uint8_t>& defects, const Region& of);

/// The key `region` of `[camera]`.
void read_region(base::TableReader& table, Region& region);

}  // namespace symrig::camera
