// SPDX-License-Identifier: Apache-2.0
// The table of camera drivers. A new driver is a folder beside v4l2, and its header and a line here
// (CONTRIBUTING.md).
#include "camera/driver.hpp"
#include "camera/genicam/genicam_driver.hpp"
#include "camera/v4l2/v4l2_driver.hpp"
#include "camera/v4l2/video_system.hpp"

#include <array>
#include <iterator>

namespace symrig {
namespace camera {

std::span<const CameraDriver> camera_drivers() {
  static constexpr std::array kDrivers{
      v4l2_driver(),
      genicam_driver(),
  };
  return kDrivers;
}

}  // namespace camera

std::vector<FoundCamera> find_cameras() {
  std::vector<FoundCamera> all;
  for (const camera::CameraDriver& driver : camera::camera_drivers()) {
    auto found = driver.find();
    std::move(found.begin(), found.end(), std::back_inserter(all));
  }
  return all;
}

Result<CameraInfo> look_at_camera(std::string_view wanted) {
  if (wanted.starts_with(camera::kGenicamPath)) return camera::look_at_genicam_camera(wanted);
  return look_at_camera(camera::linux_video(), wanted);
}

}  // namespace symrig
