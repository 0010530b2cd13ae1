// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/driver.hpp"

namespace symrig::camera {

std::unique_ptr<CameraSource> read_v4l2_camera(base::TableReader& table);
std::vector<FoundCamera> find_v4l2_cameras();

/// Cameras with a V4L2 driver.
constexpr CameraDriver v4l2_driver() {
  return {"v4l2", "cameras with a kernel driver (/dev/video0)", read_v4l2_camera, find_v4l2_cameras};
}

}  // namespace symrig::camera
