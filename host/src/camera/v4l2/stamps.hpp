// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"

#include <cstdint>
#include <string>

namespace symrig::camera {

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

}  // namespace symrig::camera
