// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/frame_reader.hpp"
#include "camera/v4l2/open_node.hpp"
#include "symrig/camera/v4l2_camera.hpp"

namespace symrig::camera {

/// Sets the format, size and rate of the settings and checks what the driver made of them.
/// fails: unknown_name (format), bad_argument (bits), device_refused (anything not taken as asked, or a
/// layout in memory that the format cannot have: the error says what the camera offers), device_lost.
Result<PictureLayout> negotiate(OpenNode& driver, const CameraSettings& settings);

}  // namespace symrig::camera
