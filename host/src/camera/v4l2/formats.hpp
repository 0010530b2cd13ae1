// SPDX-License-Identifier: Apache-2.0
// What a camera offers, and the choice of one format.
#pragma once

#include "camera/frame_reader.hpp"
#include "camera/v4l2/open_node.hpp"
#include "symrig/camera/camera_info.hpp"
#include "symrig/camera/v4l2_camera.hpp"

#include <string>
#include <vector>

namespace symrig::camera {

/// All formats with their sizes and rates, in the driver's order.
/// fails: device_lost.
Result<std::vector<FormatOffer>> read_capabilities(OpenNode& driver);

/// "Y10 (640x480, 1280x1024), GREY (16x16 to 1024x4096)": the formats that symrig can read, for error
/// messages.
std::string capabilities_text(const std::vector<FormatOffer>& offers);

/// "640x480" or "16x16 to 1024x4096".
std::string size_text(const SizeOffer& size);

/// Sets the format, size and rate of the settings, and checks what the driver set.
/// fails: unknown_name (format), bad_argument (bits), device_refused (the driver set something else, or
/// reports an impossible layout; the error lists what the camera offers), device_lost.
Result<PictureLayout> negotiate(OpenNode& driver, const CameraSettings& settings);

}  // namespace symrig::camera
