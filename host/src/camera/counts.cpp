// SPDX-License-Identifier: Apache-2.0

#include "symrig/camera/internal/counts.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <linux/videodev2.h>

namespace symrig::camera {

CountedFrame SequenceCount::begin(std::uint32_t driver) {
  begun_ = true;
  last_driver_ = driver;
  last_ = base_ + driver;
  return {last_, CountStep::first, 0};
}

CountedFrame SequenceCount::read(std::uint32_t driver) {
  if (!begun_) return begin(driver);
  const auto ahead = static_cast<std::int32_t>(driver - last_driver_);
  if (ahead == 0) return {last_, CountStep::repeated, 0};
  // No number is below the stream's first one. A jump that would go below it must be a forward jump.
  const bool back =
      ahead < 0 && last_ - base_ >= static_cast<std::uint64_t>(-static_cast<std::int64_t>(ahead));
  const std::uint64_t distance = back ? 0 : driver - last_driver_;
  last_driver_ = driver;
  if (back) {
    last_ -= static_cast<std::uint64_t>(-static_cast<std::int64_t>(ahead));
    return {last_, CountStep::backwards, 0};
  }
  last_ += distance;
  return {last_, distance == 1 ? CountStep::next : CountStep::gap, distance - 1};
}

void SequenceCount::restart() {
  if (!begun_) return;
  base_ = last_ + 2;
  begun_ = false;
}

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

namespace {

constexpr std::int64_t kNarrowIds = 65'535;  // 1 to 65535
constexpr std::size_t kRemembered = 256;     // a frame is late by a few frames at most

}  // namespace

std::int64_t FrameNumbers::ids_since(std::uint64_t id) const {
  const auto distance = static_cast<std::int64_t>(id - id_->at);
  if (wide_) return distance;
  const std::int64_t ahead = ((distance % kNarrowIds) + kNarrowIds) % kNarrowIds;
  return ahead <= kNarrowIds / 2 ? ahead : ahead - kNarrowIds;
}

/// Remembers the newest of the numbers from begin to end - 1.
void FrameNumbers::leave_out(std::uint64_t begin, std::uint64_t end) {
  for (std::uint64_t one = end - std::min<std::uint64_t>(end - begin, kRemembered); one < end; ++one)
    left_out_.insert(one);
  while (left_out_.size() > kRemembered) left_out_.erase(left_out_.begin());
}

CountedFrame FrameNumbers::read(std::uint64_t id, std::optional<std::uint32_t> counter) {
  wide_ = wide_ || id == 0 || id > static_cast<std::uint64_t>(kNarrowIds);
  std::int64_t next = 0;
  if (counter && counter_)
    next = static_cast<std::int64_t>(counter_->number) +
           static_cast<std::int32_t>(*counter - static_cast<std::uint32_t>(counter_->at));
  else if (id_)
    next = static_cast<std::int64_t>(id_->number) + ids_since(id);
  else
    next = static_cast<std::int64_t>(base_ + (counter ? *counter : id));
  const auto number = static_cast<std::uint64_t>(std::max(next, static_cast<std::int64_t>(base_)));
  CountedFrame reading{number, CountStep::first, 0, false};
  if (begun_) {
    reading.step = number == last_  ? CountStep::repeated
                   : number < last_ ? CountStep::backwards
                                    : CountStep::next;
    if (number > highest_ + 1) {
      reading.step = CountStep::gap;
      reading.missing = number - highest_ - 1;
      leave_out(highest_ + 1, number);
    }
    reading.found = left_out_.erase(number) != 0;
  }
  id_ = {id, number};
  if (counter) counter_ = {*counter, number};
  last_ = number;
  highest_ = begun_ ? std::max(highest_, number) : number;
  begun_ = true;
  return reading;
}

void FrameNumbers::restart() {
  if (!begun_) return;
  base_ = highest_ + 2;
  id_.reset();
  counter_.reset();
  wide_ = begun_ = false;
  left_out_.clear();
}

}  // namespace symrig::camera
