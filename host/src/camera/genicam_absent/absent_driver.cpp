// SPDX-License-Identifier: Apache-2.0
// Stands in for the driver of GenICam cameras in a build without Aravis.
#include "symrig/camera/internal/genicam_camera.hpp"

namespace symrig::camera {
namespace {

Error no_aravis() {
  return {ErrorCode::device_refused, "this build of symrig has no driver for GenICam cameras",
          "install libaravis-dev and build with -DSYMRIG_GENICAM=ON"};
}

class AbsentSource final : public CameraSource {
 public:
  Result<std::unique_ptr<Camera>> open(const SensorFacts&) const override { return no_aravis(); }
  std::optional<Grid> picture() const override { return {}; }
  Region region() const override { return {}; }
  std::string identity(const SensorFacts&) const override { return "no camera"; }
};

}  // namespace

std::unique_ptr<CameraSource> read_genicam_camera(base::TableReader& table) {
  table.fail("driver", no_aravis().what, no_aravis().hint);
  return std::make_unique<AbsentSource>();
}

std::vector<FoundCamera> find_genicam_cameras() {
  return {};
}

Result<CameraInfo> look_at_genicam_camera(std::string_view) {
  return no_aravis();
}

CameraDriver genicam_driver() {
  return {"genicam",
          "GigE Vision and USB3 Vision cameras",
          kGenicamPath,
          "genicam:ADDRESS",
          read_genicam_camera,
          find_genicam_cameras,
          look_at_genicam_camera};
}

}  // namespace symrig::camera
