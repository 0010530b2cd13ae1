// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/pixel_format.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A size of picture that a camera offers, or a range of them.
struct SizeOffer {
  Grid least, most;                 ///< equal for a single size
  Grid step{1, 1};                  ///< between sizes of a range
  double slowest = 0, fastest = 0;  ///< pictures a second at the smallest size; 0: the driver does not say

  bool single() const { return least == most; }
  bool holds(Grid size) const;
};

/// A pixel format that a camera offers.
struct FormatOffer {
  std::uint32_t fourcc = 0;
  std::string description;              ///< the driver's
  const PixelFormat* format = nullptr;  ///< nullptr: not one that is read here
  std::vector<SizeOffer> sizes;

  /// V4L2's name where it is known, else the FourCC.
  std::string name() const;
};

/// What values a control takes.
enum class ControlKind : std::uint8_t { integer, boolean, menu, button, bitmask, other };

/// One entry of a control that is a menu.
struct MenuItem {
  std::int64_t value = 0;
  std::string text;
};

/// A camera's setting.
struct ControlInfo {
  std::uint32_t id = 0;
  std::string name;   ///< "exposure_time_absolute": as v4l2-ctl writes it
  std::string title;  ///< "Exposure Time, Absolute"
  ControlKind kind = ControlKind::integer;
  std::int64_t least = 0, most = 0, step = 1, preset = 0;
  std::vector<MenuItem> menu;
  std::optional<std::int64_t> value;  ///< none: it cannot be read
  bool wide = false;                  ///< of 64 bits
  bool read_only = false;
  bool inactive = false;  ///< has no effect now: another control, mostly an automatic, rules it

  /// "1 to 10000 in steps of 1", "0 (Free Run), 1 (External Edge)".
  std::string range() const;
};

/// A camera that is there.
struct FoundCamera {
  std::string path;            ///< "/dev/video0"
  std::string name;            ///< "Basler daA1280-54um"
  std::string driver;          ///< "uvcvideo"
  std::string bus;             ///< "usb-0000:00:14.0-2"
  std::string serial;          ///< empty: it has none
  std::optional<Error> error;  ///< why no more is known: no permission, …
};

/// All that a camera says of itself.
struct CameraInfo {
  FoundCamera found;
  std::vector<FormatOffer> formats;
  std::vector<ControlInfo> controls;
};

namespace camera {
class VideoSystem;
}

/// Nodes that hand out pictures, by number; also those that may not be opened, with the reason. Nothing is
/// changed on them. system: the machine's, or a test's.
std::vector<FoundCamera> find_cameras(camera::VideoSystem& system);
std::vector<FoundCamera> find_cameras();

/// The one camera that `wanted` means: a path (links, too), or a serial number, a bus or a name as
/// find_cameras() has them; empty: the only one there is. Never picks one of several.
/// fails: device_lost (no camera there), unknown_name (none of that name: the text lists them),
/// bad_argument (several fit).
Result<std::string> choose_camera(camera::VideoSystem& system, std::string_view wanted);

/// Formats, sizes, rates and controls.  fails: as choose_camera(), device_refused (no permission, no camera).
Result<CameraInfo> look_at_camera(camera::VideoSystem& system, std::string_view wanted);
Result<CameraInfo> look_at_camera(std::string_view wanted);

}  // namespace symrig
