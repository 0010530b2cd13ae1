// SPDX-License-Identifier: Apache-2.0
#include "camera/v4l2/stamps.hpp"

#include <utility>

#include <fmt/format.h>
#include <linux/videodev2.h>

namespace symrig::camera {
namespace {

constexpr Nanoseconds kFutureTolerance = std::chrono::milliseconds(1);

double milliseconds(Nanoseconds t) {
  return 1e3 * seconds(t);
}

}  // namespace

StampVerdict StampJudge::distrust(std::string why) {
  trusted_ = false;
  return {StampOf::nothing, false, std::move(why)};
}

bool StampJudge::plausible(Nanoseconds at, Nanoseconds now) const {
  return at >= begin_ && at > last_ && at <= now + kFutureTolerance;
}

StampVerdict StampJudge::judge(const DriverStamp& stamp, Nanoseconds now, bool damaged) {
  const bool monotonic = (stamp.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const bool start = (stamp.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  if (damaged && !plausible(stamp.at, now)) return {};
  // Old frames are found with any stamp: a clock with another name may still be CLOCK_MONOTONIC.
  if (stamp.at < begin_ && stamp.at > Nanoseconds{} && leftovers_ > 0) {
    --leftovers_;
    return {StampOf::nothing, true, {}};
  }
  leftovers_ = 0;
  if (!trusted_) return {};
  if (!monotonic)
    return distrust("the driver does not mark its stamps as CLOCK_MONOTONIC: they are not used");
  if (stamp.at < begin_)
    return distrust("the driver's stamps are from before the start of the stream: they are not used");
  if (stamp.at > now + kFutureTolerance)
    return distrust(fmt::format("a stamp of the driver is {:.1f} ms in the future: its stamps are not used",
                                milliseconds(stamp.at - now)));
  if (stamp.at <= std::exchange(last_, stamp.at)) return {};
  return {start ? StampOf::exposure_begin : StampOf::exposure_end, false, {}};
}

}  // namespace symrig::camera
