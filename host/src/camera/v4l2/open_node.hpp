// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/v4l2/video_system.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::camera {

/// VIDIOC_QUERYCAP, as text and as what matters here.
struct DriverIdentity {
  std::string name, driver, bus;
  bool captures = false;     ///< hands out pictures through streaming buffers
  bool multiplanar = false;  ///< by the multi-planar calls
};

/// A picture format as a driver tells of it.
struct DriverFormat {
  std::uint32_t fourcc = 0;
  Grid size;
  std::size_t stride = 0;  ///< bytes a row
  std::size_t bytes = 0;   ///< a picture
  bool interlaced = false;
  int planes = 1;
};

/// One open camera node: the V4L2 calls that are needed, in the words of this library. Calls that a signal
/// interrupted are made again.
class OpenNode {
 public:
  /// fails: device_lost (not there), device_refused (no permission, held by others, no V4L2 device).
  static Result<OpenNode> open(VideoSystem& system, const std::string& path);

  /// The same, and it hands out pictures.  fails: also device_refused (it does not).
  static Result<OpenNode> open_camera(VideoSystem& system, const std::string& path);

  const std::string& path() const { return path_; }
  const DriverIdentity& identity() const { return identity_; }
  VideoNode& node() { return *node_; }
  /// V4L2_BUF_TYPE_VIDEO_CAPTURE, or the multi-planar one.
  std::uint32_t buffer_type() const;

  /// errno of the call, 0 = done.
  int call(unsigned long request, void* argument);
  /// fails: device_lost (the node is gone), device_refused (any other reason): "PATH: DOING: REASON".
  Result<void> ask(unsigned long request, void* argument, std::string_view doing);
  /// The error that an errno of this node means.
  Error error(int reason, std::string_view doing) const;

  Result<DriverFormat> format();
  /// Asks for a format and returns what the driver made of it, which may be something else.
  Result<DriverFormat> set_format(std::uint32_t fourcc, Grid size);

 private:
  OpenNode(std::string path, std::unique_ptr<VideoNode> node)
      : path_(std::move(path)), node_(std::move(node)) {}
  Result<void> identify();

  std::string path_;
  std::unique_ptr<VideoNode> node_;
  DriverIdentity identity_;
};

/// The node is no longer there, or no longer the one that was opened.
bool is_gone(int reason);

}  // namespace symrig::camera
