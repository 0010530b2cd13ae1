// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace symrig::camera {

/// What ended a wait for a frame.
enum class Wake : std::uint8_t {
  frame,        ///< a buffer may be taken
  nothing,      ///< the time is over
  interrupted,  ///< by interrupt()
  hangup        ///< the node is in error, or gone
};

/// An open /dev/video node: the calls of the kernel that are made on it, and nothing more. A seam: tests put
/// a scripted driver here. Errors are errno values, 0 is success. control() and interrupt() may be called by
/// several threads at once, also during wait().
class VideoNode {
 public:
  VideoNode() = default;
  VideoNode(const VideoNode&) = delete;
  VideoNode& operator=(const VideoNode&) = delete;
  virtual ~VideoNode() = default;

  /// ioctl(2) without waiting.
  virtual int control(unsigned long request, void* argument) = 0;
  /// mmap(2) of a buffer, shared, for reading.
  virtual int map(std::size_t length, std::int64_t offset, std::span<const std::byte>& memory) = 0;
  virtual void unmap(std::span<const std::byte> memory) = 0;
  virtual Wake wait(Nanoseconds patience) = 0;
  /// Ends the wait that is, or the next one.
  virtual void interrupt() = 0;
  /// CLOCK_MONOTONIC.
  virtual Nanoseconds now() = 0;
};

/// The nodes of a machine.
class VideoSystem {
 public:
  VideoSystem() = default;
  VideoSystem(const VideoSystem&) = delete;
  VideoSystem& operator=(const VideoSystem&) = delete;
  virtual ~VideoSystem() = default;

  /// /dev/video0, /dev/video1, …, by number.
  virtual std::vector<std::string> paths() = 0;
  /// The serial number of the device behind a node; empty: it has none.
  virtual std::string serial(const std::string& path) = 0;
  virtual int open(const std::string& path, std::unique_ptr<VideoNode>& node) = 0;
};

/// This machine's.
VideoSystem& linux_video();

}  // namespace symrig::camera
