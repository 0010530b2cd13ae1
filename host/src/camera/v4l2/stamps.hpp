// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"

#include <cstdint>
#include <string>

namespace symrig::camera {

/// A buffer's stamp as the driver gives it.
struct DriverStamp {
  Nanoseconds at{};
  std::uint32_t flags = 0;  ///< of the buffer: which clock, which moment
};

/// What a stamp is worth.
struct StampVerdict {
  StampOf of = StampOf::nothing;
  bool stale = false;  ///< the frame is older than the stream: throw it away
  std::string note;    ///< what has just been found out about the driver's clock; mostly empty
};

/// Tells stamps on CLOCK_MONOTONIC from others. A driver whose stamps cannot be on that clock, whatever its
/// flags say, is not believed again until the next stream:
///   flags name another clock, or none;
///   a stamp later than the moment when its frame was taken, by more than 1 ms (which a driver may err that
///   reckons them from a camera's own clock);
///   stamps before the start of the stream, in more frames than could have been left from before.
/// A single stamp that is not after the one before it tells nothing, for that frame alone.
class StampJudge {
 public:
  /// begin: when the stream was started. leftovers: frames that may be older than it, one a buffer.
  StampJudge(Nanoseconds begin, int leftovers) : begin_(begin), leftovers_(leftovers) {}

  /// now: CLOCK_MONOTONIC when the frame was taken. A damaged frame is never stale and convicts nobody.
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
