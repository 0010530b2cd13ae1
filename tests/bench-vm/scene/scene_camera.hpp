// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/delivery.hpp"
#include "bench-vm/scene/ports.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig::bench_vm {

/// Where the pixels of the simulated camera are in the picture that the test camera delivers. The format is
/// Y12, with the first simulated pixel at (top, left). Other pixels are dark.
struct CameraPicture {
  Grid picture;
  Grid camera;  ///< of the simulated camera: the cells, or pixels of its own
  int top = 0;
  int left = 0;
  std::uint16_t dark = 0;  ///< code of an unlit pixel

  /// fails: size_mismatch (the camera's pixels are not inside the picture).
  Result<void> check() const;
  /// codes: of the camera's pixels, raster order. Returns two bytes per pixel, little-endian.
  std::vector<std::uint8_t> bytes(std::span<const std::uint16_t> codes) const;
};

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

/// How the GigE Vision camera and its link are.
struct GigeLink {
  std::string address;     ///< on the loopback network, such as 127.0.7.1
  Grid camera;             ///< of the simulated camera
  Nanoseconds readout{0};  ///< as the camera states it
  double packet_loss = 0;  ///< share of stream packets that are lost
};

/// How the USB3 Vision camera is.
struct Usb3Link {
  std::string serial;         ///< by which the host finds it
  Grid camera;                ///< of the simulated camera
  Nanoseconds readout{0};     ///< as the camera states it
  std::uint16_t port = 3240;  ///< of its USB/IP server. 0: any that is free
};

/// The GigE Vision camera of tests/gige: control and frames are packets of the guest's network. Its trigger
/// counter counts the frames that the link lost. It delivers late and swapped frames with the next one, and
/// with their own stamps.
/// fails: bad_argument (a fault that this camera has not), io (the address is taken).
Result<std::unique_ptr<SceneCamera>> open_gige_camera(const GigeLink& link, const FaultRates& faults);

/// The USB3 Vision camera of tests/u3v behind USB/IP (`usbip attach -r 127.0.0.1 -b 1-1`), with the same
/// faults. After it was unplugged, attach it again.
/// fails: as open_gige_camera; io (the port is taken).
Result<std::unique_ptr<SceneCamera>> open_usb3_camera(const Usb3Link& link, const FaultRates& faults);

/// Two cameras that one trigger fires. Each gets its half of a frame's columns. `lost`: the number of a frame
/// that the right camera loses. The left one says what stamps mark.
std::unique_ptr<SceneCamera> pair_cameras(std::unique_ptr<SceneCamera> left,
                                          std::unique_ptr<SceneCamera> right, Grid each,
                                          std::optional<std::uint64_t> lost);

}  // namespace symrig::bench_vm
