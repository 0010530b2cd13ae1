// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"
#include "symrig/camera/camera_info.hpp"
#include "symrig/camera/frame_format.hpp"
#include "symrig/camera/internal/driver.hpp"
#include "symrig/camera/v4l2_camera.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::camera {

/// What a frame's chunk data says; CameraFrame::attachment of a GenICam camera that has chunks.
struct FrameChunks {
  std::optional<std::uint32_t> trigger_counter;
  std::optional<Nanoseconds> exposure;
};

/// How to set up a GenICam camera.
struct GenicamSettings {
  std::string device;      ///< path, serial number, address or name; empty: the only camera
  std::string format;      ///< PFNC name; empty: the camera's format with the most bits
  Region region;           ///< the camera sends this part of its picture only; binning is summed by the host
  int camera_binning = 0;  ///< pixels that the camera itself bins along each side; 0: as it is set
  int bits = 0;            ///< significant bits in a 16-bit format; 0: all
  Justified justified = Justified::high;
  std::string line = "Line1";             ///< TriggerSource; empty: the camera runs free
  std::string activation = "RisingEdge";  ///< TriggerActivation
  std::optional<Nanoseconds> exposure;    ///< none: as long as the trigger is active
  bool overlap = false;                   ///< exposes during the readout of the last frame
  std::optional<double> gain, black_level;
  StampOf stamp = StampOf::nothing;  ///< what the camera's time stamps mark; GenICam does not say it
  bool chunks = true;                ///< use the trigger counter and exposure of chunk data if there are any
  std::vector<ControlSetting> features;  ///< set in this order, after the rest
  std::optional<NoiseModel> noise;       ///< of a single sample; none: gain 1 DN/e⁻, no read noise
  CameraTiming timing;
  Image<std::uint8_t> dead;
  int buffers = 64;                         ///< fewer if frames are large: 256 MiB are enough
  std::size_t waiting = 64;                 ///< longest queue of frames for take()
  std::optional<std::size_t> socket_limit;  ///< bytes, instead of net.core.rmem_max: for tests
};

/// A GigE Vision or USB3 Vision camera, by Aravis. Frames arrive from the moment it is open.
class GenicamCamera final : public Camera {
 public:
  /// fails: as open_device(); unknown_name (format, feature), bad_argument, device_refused, device_lost.
  static Result<std::unique_ptr<GenicamCamera>> open(GenicamSettings settings);
  ~GenicamCamera() override;

  Grid grid() const override;
  int channels() const override { return 1; }
  /// The limits of the settings and of the camera's own nodes.
  CameraTiming timing() const override;
  const NoiseModel& noise() const override;
  const Image<std::uint8_t>* dead() const override;
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override;
  /// "Mono12 64x64 from genicam:169.254.1.2 (Maker Model)"
  std::string describe() const override;

  Mosaic mosaic() const override;
  const FoundCamera& found() const;
  StreamReport report() const;

 private:
  struct Inside;
  explicit GenicamCamera(std::unique_ptr<Inside> inside);
  std::unique_ptr<Inside> inside_;
};

/// How the path of a GenICam camera begins: "genicam:" and its identifier.
constexpr std::string_view kGenicamPath = "genicam:";

std::unique_ptr<CameraSource> read_genicam_camera(base::TableReader& table);
std::vector<FoundCamera> find_genicam_cameras();
/// fails: device_lost, device_refused; unavailable features are left out.
Result<CameraInfo> look_at_genicam_camera(std::string_view path);

/// GigE Vision and USB3 Vision cameras, by Aravis.
CameraDriver genicam_driver();

}  // namespace symrig::camera
