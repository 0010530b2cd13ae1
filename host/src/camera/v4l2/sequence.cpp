// SPDX-License-Identifier: Apache-2.0
#include "camera/v4l2/sequence.hpp"

namespace symrig::camera {

SequenceCount::Reading SequenceCount::begin(std::uint32_t driver) {
  begun_ = true;
  last_driver_ = driver;
  last_ = base_ + driver;
  return {last_, Step::first, 0};
}

SequenceCount::Reading SequenceCount::read(std::uint32_t driver) {
  if (!begun_) return begin(driver);
  const auto ahead = static_cast<std::int32_t>(driver - last_driver_);
  if (ahead == 0) return {last_, Step::repeated, 0};
  // No number is below the stream's first one. A jump that would go below it must be a forward jump.
  const bool back =
      ahead < 0 && last_ - base_ >= static_cast<std::uint64_t>(-static_cast<std::int64_t>(ahead));
  const std::uint64_t distance = back ? 0 : driver - last_driver_;
  last_driver_ = driver;
  if (back) {
    last_ -= static_cast<std::uint64_t>(-static_cast<std::int64_t>(ahead));
    return {last_, Step::backwards, 0};
  }
  last_ += distance;
  return {last_, distance == 1 ? Step::next : Step::gap, distance - 1};
}

void SequenceCount::restart() {
  if (!begun_) return;
  base_ = last_ + 2;
  begun_ = false;
}

}  // namespace symrig::camera
