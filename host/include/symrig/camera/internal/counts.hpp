// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"

#include <cstdint>
#include <optional>
#include <set>
#include <string>

namespace symrig::camera {

/// How a frame's number compares to the previous one.
enum class CountStep : std::uint8_t { first, next, gap, repeated, backwards };

/// What a frame's number means.
struct CountedFrame {
  std::uint64_t number = 0;  ///< it does not wrap
  CountStep step = CountStep::first;
  std::uint64_t missing = 0;  ///< CountStep::gap: the numbers left out before this frame
  bool found =
      false;  ///< its number was left out before: the frame is out of order; told by FrameNumbers only
};

/// Extends a driver's 32-bit frame count: it does not wrap, and it continues when the stream restarts.
class SequenceCount {
 public:
  /// A number up to 2^31 away from the previous one is compared directly. A greater distance means that the
  /// count wrapped.
  CountedFrame read(std::uint32_t driver);
  /// The driver restarts its count. Skips at least one number, so that frames of two streams are never
  /// adjacent.
  void restart();

 private:
  CountedFrame begin(std::uint32_t driver);

  std::uint64_t base_ = 0;  // extended number of the driver's frame 0 in this stream
  std::uint64_t last_ = 0;
  std::uint32_t last_driver_ = 0;
  bool begun_ = false;
};

/// A buffer's time stamp from the driver.
struct DriverStamp {
  Nanoseconds at{};
  std::uint32_t flags = 0;  ///< buffer flags: which clock, which moment
};

/// What a stamp can be used for.
struct StampVerdict {
  StampOf of = StampOf::nothing;
  bool stale = false;  ///< the frame is older than the stream: discard it
  std::string note;    ///< a new finding about the driver's clock; usually empty
};

/// Finds out if a driver's stamps are on CLOCK_MONOTONIC. If not, its stamps are ignored until the next
/// stream. The reasons are:
///   the flags name another clock, or none;
///   a stamp is more than 1 ms later than the moment when its frame was taken. A driver that converts a
///   camera's own clock may be wrong by 1 ms;
///   more frames have stamps before the start of the stream than there are buffers.
/// A single stamp that is not later than the previous one is ignored for that frame only.
class StampJudge {
 public:
  /// begin: the start of the stream. leftovers: the greatest number of frames that may be older, one per
  /// buffer.
  StampJudge(Nanoseconds begin, int leftovers) : begin_(begin), leftovers_(leftovers) {}

  /// now: CLOCK_MONOTONIC when the frame was taken. A damaged frame is never stale, and never makes the
  /// driver distrusted.
  StampVerdict judge(const DriverStamp& stamp, Nanoseconds now, bool damaged);

 private:
  StampVerdict distrust(std::string why);
  bool plausible(Nanoseconds at, Nanoseconds now) const;

  Nanoseconds begin_;
  int leftovers_;
  Nanoseconds last_{};
  bool trusted_ = true;
};

/// Extends a camera's frame ids, or its trigger counter, to numbers that do not wrap. GVSP 1.x has ids of 16
/// bits, which skip 0: 65535 is followed by 1 [GigE Vision 1.2, §24]. Later ids have 64 bits. An id of 0 or
/// above 65535 shows which kind it is.
class FrameNumbers {
 public:
  /// counter: the trigger counter of the frame's chunk data; it counts triggers whose frame was lost.
  CountedFrame read(std::uint64_t id, std::optional<std::uint32_t> counter);
  /// The camera restarts its count. At least one number is skipped, so that frames of two streams are never
  /// adjacent.
  void restart();

 private:
  struct Anchor {
    std::uint64_t at = 0;      // the camera's number
    std::uint64_t number = 0;  // ours
  };

  std::int64_t ids_since(std::uint64_t id) const;
  void leave_out(std::uint64_t begin, std::uint64_t end);

  std::optional<Anchor> id_, counter_;
  std::uint64_t base_ = 0, last_ = 0, highest_ = 0;
  bool wide_ = false, begun_ = false;
  std::set<std::uint64_t> left_out_;  // the newest numbers without a frame
};

}  // namespace symrig::camera
