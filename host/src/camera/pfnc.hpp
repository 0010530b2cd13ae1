// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/pixel_format.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace symrig::camera {

/// Formats of GenICam cameras that symrig can read, by their PFNC codes and names [EMVA, Pixel Format Naming
/// Convention]. In the order of preference of pixel_formats().
std::span<const PixelFormat> genicam_formats();
/// nullptr: symrig cannot read it.
const PixelFormat* find_genicam_format(std::string_view name);

}  // namespace symrig::camera
