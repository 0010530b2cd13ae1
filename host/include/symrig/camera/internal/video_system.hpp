// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace symrig::camera {

/// Why a wait for a frame ended.
enum class Wake : std::uint8_t {
  frame,        ///< a buffer can be taken
  nothing,      ///< time-out
  interrupted,  ///< interrupt() was called
  hangup        ///< the node has an error, or is lost
};

/// An open /dev/video node: only the kernel calls on it. Tests replace it with a scripted driver. Errors are
/// errno values, 0 is success. Several threads may call control() and interrupt() at once, also during
/// wait().
class VideoNode {
 public:
  VideoNode() = default;
  VideoNode(const VideoNode&) = delete;
  VideoNode& operator=(const VideoNode&) = delete;
  virtual ~VideoNode() = default;

  /// ioctl(2), nonblocking.
  virtual int control(unsigned long request, void* argument) = 0;
  /// mmap(2) of a buffer, shared, for reading.
  virtual int map(std::size_t length, std::int64_t offset, std::span<const std::byte>& memory) = 0;
  virtual void unmap(std::span<const std::byte> memory) = 0;
  virtual Wake wait(Nanoseconds patience) = 0;
  /// Ends the current wait, or the next one.
  virtual void interrupt() = 0;
  /// CLOCK_MONOTONIC.
  virtual Nanoseconds now() = 0;
};

/// The camera nodes of a computer.
class VideoSystem {
 public:
  VideoSystem() = default;
  VideoSystem(const VideoSystem&) = delete;
  VideoSystem& operator=(const VideoSystem&) = delete;
  virtual ~VideoSystem() = default;

  /// /dev/video0, /dev/video1, …, sorted by number.
  virtual std::vector<std::string> paths() = 0;
  /// The serial number of the device behind a node. Empty: none.
  virtual std::string serial(const std::string& path) = 0;
  virtual int open(const std::string& path, std::unique_ptr<VideoNode>& node) = 0;
};

/// This computer's nodes.
VideoSystem& linux_video();

}  // namespace symrig::camera
