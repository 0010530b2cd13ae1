// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/camera_picture.hpp"
#include "bench-vm/scene/delivery.hpp"
#include "bench-vm/scene/ports.hpp"
#include "symrig/base/result.hpp"

#include <memory>
#include <string>

namespace symrig::bench_vm {

/// The camera on which the scene's light falls, as the host has set it.
class SceneCamera {
 public:
  struct Settings {
    bool follows_pulse = false;  ///< exposes while its trigger is high
    bool stamps_begin = false;   ///< stamps mark the begin of the exposure, not its end
  };

  SceneCamera() = default;
  SceneCamera(const SceneCamera&) = delete;
  SceneCamera& operator=(const SceneCamera&) = delete;
  virtual ~SceneCamera() = default;

  /// fails: bad_format, size_mismatch (the host has set what the scene does not make), io.
  virtual Result<Settings> settings() const = 0;
  /// fails: size_mismatch, io.
  virtual Result<CameraPort::Taken> deliver(const DeliveredFrame& frame) = 0;
  /// Unplugs the camera, or plugs it in.
  /// fails: io.
  virtual Result<void> plug(bool in) = 0;
  /// true: the camera itself delivers late and swapped frames late and swapped. It gets all frames in the
  /// order of exposure, when they are due.
  virtual bool delays_frames() const { return false; }
  /// What happened on the way to the host. Empty: the tally says it all.
  virtual std::string report() const { return {}; }
};

/// The test camera of V4L2 (modules/testcam).
/// fails: as CameraPort::open, CameraPicture::check.
Result<std::unique_ptr<SceneCamera>> open_v4l2_camera(const CameraPicture& picture);

}  // namespace symrig::bench_vm
