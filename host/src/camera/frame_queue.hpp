// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/camera.hpp"

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace symrig::camera {

/// Frames on their way from a driver's thread to take(), and their count. Thread-safe.
class FrameQueue {
 public:
  /// waiting: longest queue; a take() of more frames lengthens it. report: of this camera's earlier streams.
  FrameQueue(std::size_t waiting, StreamReport report) : room_(waiting), report_(std::move(report)) {}

  /// A frame that finds the queue full is dropped and counted.
  void keep(CameraFrame frame);
  /// No frame will come any more.
  void lose(Error error);
  bool lost() const;
  /// A remark, kept once.
  void note(const std::string& line);
  template <class Change>
  void count(Change change) {
    const std::lock_guard lock(mutex_);
    change(report_);
  }

  /// As Camera::take(). Frames that came before the end of the stream are returned first.
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience);
  StreamReport report() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<CameraFrame> queue_;
  std::uint64_t arrived_ = 0;  // frames kept since the start
  std::size_t room_;
  StreamReport report_;
  std::optional<Error> lost_;
};

}  // namespace symrig::camera
