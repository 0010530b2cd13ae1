// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"
#include "symrig/camera/camera_info.hpp"
#include "symrig/camera/frame_format.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A control and its new value: a number, a menu entry's text, on or off.
struct ControlSetting {
  std::string name;
  std::string value;
};

/// Where a sample of fewer bits lies in the 16-bit word.
enum class Justified : std::uint8_t { low, high };

/// How to set up a camera.
struct CameraSettings {
  std::string device;  ///< as choose_camera(); empty: the only camera
  std::string format;  ///< V4L2's name or FourCC; empty: the camera's linear format with the most bits
  Grid size;           ///< of the driver's picture; {0, 0}: the current size
  double rate = 0;     ///< pictures a second, set and verified within 1 %; 0: do not change
  int bits = 0;        ///< significant bits in a 16-bit format; 0: all 16
  Justified justified = Justified::high;  ///< used with `bits` only
  Region region;                          ///< which part of the picture is kept, and its binning
  std::vector<ControlSetting> controls;   ///< set in this order, after the format
  /// Of a single sample, before binning, in the same number of bits. None: gain 1 DN/e⁻, no pedestal, no read
  /// noise. That is enough to look at codes, but not to merge.
  std::optional<NoiseModel> noise;
  CameraTiming timing;
  Image<std::uint8_t> dead;  ///< grid of the frames × 1, 1 = dead; empty: none known
  int buffers = 8;           ///< shared with the driver, 2 to 32
  /// Longest queue of frames for take(), at least 1. Frames beyond it are lost and counted. A take() of more
  /// frames lengthens the queue.
  std::size_t waiting = 64;
};

/// A camera that a V4L2 driver runs. Frames arrive from the moment it is open, in a thread of its own. They
/// hold the codes of the selected region, binned. A mosaic stays a mosaic (channels() = 1). Stamps are
/// CLOCK_MONOTONIC or StampOf::nothing.
///
/// After device_lost the object stays valid. reopen() finds the same camera by bus and serial number, even
/// under another /dev/video. Sequence numbers continue after a gap.
class V4l2Camera final : public Camera {
 public:
  /// Reads every setting back. It is an error if the driver changed one; the error lists what the camera
  /// offers.
  /// fails: as choose_camera(); device_refused (another program uses it, no permission, format, size or rate
  /// not accepted), bad_argument (contradicting settings), unknown_name (format, control).
  static Result<std::unique_ptr<V4l2Camera>> open(CameraSettings settings);
  /// The same with another VideoSystem, for tests. The system must outlive the camera.
  static Result<std::unique_ptr<V4l2Camera>> open(CameraSettings settings, camera::VideoSystem& system);
  ~V4l2Camera() override;

  Grid grid() const override;
  int channels() const override { return 1; }
  CameraTiming timing() const override;
  /// Of the delivered codes, after binning.
  const NoiseModel& noise() const override;
  const Image<std::uint8_t>* dead() const override;
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override;
  /// "Y12 1280x1024 from /dev/video0 (Basler daA1280-54um), 640x512 bins of 2x2"
  std::string describe() const override;

  /// The mosaic of the frames.
  Mosaic mosaic() const override;
  const PixelFormat& format() const;
  /// Path, name, driver, bus and serial number of this camera.
  const FoundCamera& found() const;
  StreamReport report() const;

  /// Sets a control and reads it back.
  /// fails: as CameraSettings::controls, device_lost.
  Result<void> set_control(std::string_view name, std::string_view value);
  Result<std::int64_t> control(std::string_view name);

  /// Opens the camera again with the same settings, after device_lost or to drop all pending frames.
  /// fails: device_lost (the camera is not back), as open().
  Result<void> reopen();

 private:
  struct Inside;
  explicit V4l2Camera(std::unique_ptr<Inside> inside);
  std::unique_ptr<Inside> inside_;
};

}  // namespace symrig
