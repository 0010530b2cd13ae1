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
  // A clock that names itself something else may still be this one: old frames are told by any stamp.
  if (stamp.at < begin_ && stamp.at > Nanoseconds{} && leftovers_ > 0) {
    --leftovers_;
    return {StampOf::nothing, true, {}};
  }
  leftovers_ = 0;
  if (!trusted_) return {};
  if (!monotonic)
    return distrust("the driver does not say that its stamps are on CLOCK_MONOTONIC: they are not used");
  if (stamp.at < begin_)
    return distrust("the driver's stamps lie before the start of the stream: they are not used");
  if (stamp.at > now + kFutureTolerance)
    return distrust(fmt::format("the driver's stamps lie in the future, one by {:.1f} ms: they are not used",
                                milliseconds(stamp.at - now)));
  if (stamp.at <= std::exchange(last_, stamp.at)) return {};
  return {start ? StampOf::exposure_begin : StampOf::exposure_end, false, {}};
}

}  // namespace symrig::camera
