// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/camera_info.hpp"
#include "symrig/camera/internal/frame_reader.hpp"
#include "symrig/camera/internal/video_system.hpp"
#include "symrig/camera/v4l2_camera.hpp"
#include "symrig/image/grid.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::camera {

/// The useful part of VIDIOC_QUERYCAP.
struct DriverIdentity {
  std::string name, driver, bus;
  bool captures = false;     ///< can stream pictures
  bool multiplanar = false;  ///< needs the multi-planar calls
};

/// A picture format as the driver reports it.
struct DriverFormat {
  std::uint32_t fourcc = 0;
  Grid size;
  std::size_t stride = 0;  ///< bytes per row
  std::size_t bytes = 0;   ///< bytes per picture
  bool interlaced = false;
  int planes = 1;
};

/// One open camera node: the V4L2 calls that symrig needs. Repeats calls that a signal interrupted.
class OpenNode {
 public:
  /// fails: device_lost (missing), device_refused (no permission, used by another program, not a V4L2
  /// device).
  static Result<OpenNode> open(VideoSystem& system, const std::string& path);

  /// The same, but the node must stream pictures.
  /// fails: also device_refused (it does not).
  static Result<OpenNode> open_camera(VideoSystem& system, const std::string& path);

  const std::string& path() const { return path_; }
  const DriverIdentity& identity() const { return identity_; }
  VideoNode& node() { return *node_; }
  /// V4L2_BUF_TYPE_VIDEO_CAPTURE or its multi-planar form.
  std::uint32_t buffer_type() const;

  /// Returns the errno of the call, 0 = success.
  int call(unsigned long request, void* argument);
  /// fails: device_lost (the node is lost), device_refused (any other reason): "PATH: DOING: REASON".
  Result<void> ask(unsigned long request, void* argument, std::string_view doing);
  /// The error for an errno of this node.
  Error error(int reason, std::string_view doing) const;

  Result<DriverFormat> format();
  /// Requests a format and returns the format that the driver set, which may differ.
  Result<DriverFormat> set_format(std::uint32_t fourcc, Grid size);

 private:
  OpenNode(std::string path, std::unique_ptr<VideoNode> node)
      : path_(std::move(path)), node_(std::move(node)) {}
  Result<void> identify();

  std::string path_;
  std::unique_ptr<VideoNode> node_;
  DriverIdentity identity_;
};

/// The errno means that the node is missing, or that another device has its place.
bool is_gone(int reason);

/// A driver's unsigned size as an int; sizes beyond an int become the largest int.
int as_int(std::uint32_t value);

/// All enabled controls with their values, in the driver's order.
/// fails: device_lost.
Result<std::vector<ControlInfo>> read_controls(OpenNode& driver);

/// Finds a control by name or title.
/// fails: unknown_name (the hint gives the nearest name).
Result<ControlInfo> find_control(OpenNode& driver, std::string_view name);

/// Reads a value for this control from text: a number, a menu entry, or on/off/true/false.
/// fails: bad_argument (out of range or between steps; the hint gives the nearest value).
Result<std::int64_t> control_value(const ControlInfo& control, std::string_view text);

/// Sets the control and reads it back.
/// fails: bad_argument, device_lost, device_refused (read-only, refused by the driver, or the driver stored
/// another value).
Result<void> set_control(OpenNode& driver, const ControlInfo& control, std::int64_t value);
Result<std::int64_t> get_control(OpenNode& driver, const ControlInfo& control);

// What a camera offers, and the choice of one format.

/// All formats with their sizes and rates, in the driver's order.
/// fails: device_lost.
Result<std::vector<FormatOffer>> read_capabilities(OpenNode& driver);

/// "Y10 (640x480, 1280x1024), GREY (16x16 to 1024x4096)": the formats that symrig can read, for error
/// messages.
std::string capabilities_text(const std::vector<FormatOffer>& offers);

/// "640x480" or "16x16 to 1024x4096".
std::string size_text(const SizeOffer& size);

/// Sets the format, size and rate of the settings, and checks what the driver set.
/// fails: unknown_name (format), bad_argument (bits), device_refused (the driver set something else, or
/// reports an impossible layout; the error lists what the camera offers), device_lost.
Result<PictureLayout> negotiate(OpenNode& driver, const CameraSettings& settings);

}  // namespace symrig::camera
