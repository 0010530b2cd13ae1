// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/scene_camera.hpp"

#include <utility>

namespace symrig::bench_vm {

namespace {

class V4l2SceneCamera final : public SceneCamera {
 public:
  V4l2SceneCamera(CameraPort port, const CameraPicture& picture)
      : port_(std::move(port)), picture_(picture) {}

  Result<Settings> settings() const override {
    SYMRIG_TRY(const CameraState state, port_.state());
    if (state.streaming && !state.is_y12)
      return Error{ErrorCode::bad_format, "the host has set a format other than Y12",
                   "give format = \"Y12\" in the rig file"};
    return Settings{state.follows_pulse, state.stamps_begin};
  }
  Result<CameraPort::Taken> deliver(const DeliveredFrame& frame) override {
    return port_.deliver({frame.stamp, frame.skip, frame.damaged}, picture_.bytes(*frame.codes));
  }
  Result<void> plug(bool in) override { return port_.plug(in); }

 private:
  CameraPort port_;
  CameraPicture picture_;
};

}  // namespace

Result<std::unique_ptr<SceneCamera>> open_v4l2_camera(const CameraPicture& picture) {
  SYMRIG_CHECK(picture.check());
  SYMRIG_TRY(const std::string path, bench_variable("BENCH_CAMERA_INJECT"));
  SYMRIG_TRY(CameraPort port, CameraPort::open(path));
  return std::unique_ptr<SceneCamera>(std::make_unique<V4l2SceneCamera>(std::move(port), picture));
}

}  // namespace symrig::bench_vm
