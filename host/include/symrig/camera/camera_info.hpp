// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/frame_format.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// One picture size that a camera offers, or a range of sizes.
struct SizeOffer {
  Grid least, most;                 ///< equal for a single size
  Grid step{1, 1};                  ///< from one size of a range to the next
  double slowest = 0, fastest = 0;  ///< pictures a second at the smallest size; 0: unknown

  bool single() const { return least == most; }
  bool holds(Grid size) const;
};

/// A pixel format that a camera offers.
struct FormatOffer {
  std::uint32_t fourcc = 0;             ///< 0: GenICam, and symrig cannot read it
  std::string description;              ///< from the driver
  const PixelFormat* format = nullptr;  ///< nullptr: symrig cannot read this format
  std::vector<SizeOffer> sizes;

  /// V4L2's or GenICam's name if symrig knows the format, else the FourCC. GenICam: always its name.
  std::string name() const;
};

/// The type of a control's value.
enum class ControlKind : std::uint8_t { integer, boolean, menu, button, bitmask, other };

/// One entry of a menu control.
struct MenuItem {
  std::int64_t value = 0;
  std::string text;
};

/// A control: one of the camera's settings.
struct ControlInfo {
  std::uint32_t id = 0;
  std::string name;   ///< "exposure_time_absolute", as v4l2-ctl writes it
  std::string title;  ///< "Exposure Time, Absolute"
  ControlKind kind = ControlKind::integer;
  std::int64_t least = 0, most = 0, step = 1, preset = 0;
  std::vector<MenuItem> menu;
  std::optional<std::int64_t> value;  ///< none: the control cannot be read
  bool wide = false;                  ///< 64 bits
  bool read_only = false;
  bool inactive = false;  ///< no effect now: another control, usually an automatic one, overrides it

  /// "1 to 10000 in steps of 1", "0 (Free Run), 1 (External Edge)".
  std::string range() const;
};

/// A connected camera.
struct FoundCamera {
  std::string path;            ///< "/dev/video0"
  std::string name;            ///< "Basler daA1280-54um"
  std::string driver;          ///< "uvcvideo"
  std::string bus;             ///< "usb-0000:00:14.0-2"
  std::string serial;          ///< empty: the camera has no serial number
  std::optional<Error> error;  ///< why the other fields are empty, for example no permission
};

/// Everything that a camera reports about itself.
struct CameraInfo {
  FoundCamera found;
  std::vector<FormatOffer> formats;
  std::vector<ControlInfo> controls;
};

namespace camera {
class VideoSystem;
}

/// All nodes that capture pictures, sorted by number. A node that cannot be opened is listed with the reason.
/// Changes nothing on the cameras. system: the computer's, or a test's.
std::vector<FoundCamera> find_cameras(camera::VideoSystem& system);
std::vector<FoundCamera> find_cameras();

/// Finds the one camera that `wanted` names. `wanted` is a path (links are followed), or a serial number, bus
/// or name as find_cameras() returns them. Empty: the only camera. Never picks one of several.
/// fails: device_lost (no camera), unknown_name (no match; the text lists the cameras), bad_argument (several
/// match).
Result<std::string> choose_camera(camera::VideoSystem& system, std::string_view wanted);

/// Formats, sizes, rates and controls.
/// fails: as choose_camera(), device_refused (no permission, not a camera).
Result<CameraInfo> look_at_camera(camera::VideoSystem& system, std::string_view wanted);
Result<CameraInfo> look_at_camera(std::string_view wanted);

/// How the paths of cameras are written, a form for each driver: "/dev/videoN, genicam:ADDRESS".
std::string camera_path_forms();

}  // namespace symrig
