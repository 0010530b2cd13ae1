// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"
#include "symrig/camera/camera_info.hpp"
#include "symrig/camera/mosaic.hpp"
#include "symrig/camera/pixel_format.hpp"
#include "symrig/camera/region.hpp"
#include "symrig/camera/stream_report.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A control and the value that it shall have: a number, a menu entry's text, on or off.
struct ControlSetting {
  std::string name;
  std::string value;
};

/// Where the sample stands in the words of a 16-bit format, for a camera that has fewer bits.
enum class Justified : std::uint8_t { low, high };

/// What is wanted of a camera.
struct CameraSettings {
  std::string device;  ///< as choose_camera(); empty: the only one there is
  std::string format;  ///< V4L2's name or FourCC; empty: the deepest linear one of the camera
  Grid size;           ///< of the driver's picture; {0, 0}: the size that it has now
  double rate = 0;     ///< pictures a second, set and verified within 1 %; 0: as it is
  int bits = 0;        ///< significant bits in a 16-bit format; 0: all that the format has
  Justified justified = Justified::high;  ///< used with `bits` only
  Region region;                          ///< what is kept of the picture, and its binning
  std::vector<ControlSetting> controls;   ///< set in this order, after the format
  /// Of one sample of the sensor, before binning, with as many bits. None: gain 1 DN/e⁻, no pedestal, no
  /// read noise: a stand-in for looking at codes, not for merging.
  std::optional<NoiseModel> noise;
  CameraTiming timing;
  Image<std::uint8_t> dead;  ///< grid of the frames × 1, 1 = dead; empty: none known
  int buffers = 8;           ///< shared with the driver, 2 to 32
  /// Frames that wait for take(), at least 1; more are lost and counted. A take() that asks for more makes
  /// room for them.
  std::size_t waiting = 64;
};

/// A camera behind V4L2. Frames come as soon as it is open, in a thread of its own, as codes of the settings'
/// region and binning; a mosaic stays one (channels() = 1). Stamps are CLOCK_MONOTONIC or StampOf::nothing.
///
/// After device_lost the object stays: reopen() finds the same camera again, by bus and serial number, also
/// under another /dev/video. Sequence numbers go on with a gap.
class V4l2Camera final : public Camera {
 public:
  /// Every setting is read back: a driver that makes something else of one is an error, which lists what the
  /// camera offers.
  /// fails: as choose_camera(); device_refused (held by another program, no permission, format, size or rate
  /// not taken), bad_argument (settings that contradict each other), unknown_name (format, control).
  static Result<std::unique_ptr<V4l2Camera>> open(CameraSettings settings);
  /// The same on another system, which must outlive the camera: for tests.
  static Result<std::unique_ptr<V4l2Camera>> open(CameraSettings settings, camera::VideoSystem& system);
  ~V4l2Camera() override;

  Grid grid() const override;
  int channels() const override { return 1; }
  CameraTiming timing() const override;
  /// Of the codes handed over: binning is in it.
  const NoiseModel& noise() const override;
  const Image<std::uint8_t>* dead() const override;
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override;
  /// "Y12 1280x1024 from /dev/video0 (Basler daA1280-54um), 640x512 of 2x2 binned"
  std::string describe() const override;

  /// Colours of the frames' pixels.
  Mosaic mosaic() const;
  const PixelFormat& format() const;
  /// Which camera it is.
  const FoundCamera& found() const;
  StreamReport report() const;

  /// Sets a control and reads it back.  fails: as CameraSettings::controls, device_lost.
  Result<void> set_control(std::string_view name, std::string_view value);
  Result<std::int64_t> control(std::string_view name);

  /// Opens the camera again with the same settings: after device_lost, or to drop all frames on the way.
  /// fails: device_lost (it is not back), as open().
  Result<void> reopen();

 private:
  struct Inside;
  explicit V4l2Camera(std::unique_ptr<Inside> inside);
  std::unique_ptr<Inside> inside_;
};

}  // namespace symrig
