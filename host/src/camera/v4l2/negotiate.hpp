// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/frame_reader.hpp"
#include "camera/v4l2/open_node.hpp"
#include "symrig/camera/v4l2_camera.hpp"

namespace symrig::camera {

/// Sets the format, size and rate of the settings, and checks what the driver set.
/// fails: unknown_name (format), bad_argument (bits), device_refused (the driver set something else, or
/// reports an impossible layout; the error lists what the camera offers), device_lost.
Result<PictureLayout> negotiate(OpenNode& driver, const CameraSettings& settings);

}  // namespace symrig::camera
