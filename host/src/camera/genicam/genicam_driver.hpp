// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/driver.hpp"

namespace symrig::camera {

/// How the path of a GenICam camera begins: "genicam:" and its identifier.
constexpr std::string_view kGenicamPath = "genicam:";

std::unique_ptr<CameraSource> read_genicam_camera(base::TableReader& table);
std::vector<FoundCamera> find_genicam_cameras();
/// fails: device_lost, device_refused; unavailable features are left out.
Result<CameraInfo> look_at_genicam_camera(std::string_view path);

/// GigE Vision and USB3 Vision cameras, by Aravis.
constexpr CameraDriver genicam_driver() {
  return {"genicam", "GigE Vision and USB3 Vision cameras", read_genicam_camera, find_genicam_cameras};
}

}  // namespace symrig::camera
