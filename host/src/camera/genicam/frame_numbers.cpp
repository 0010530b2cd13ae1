// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/frame_numbers.hpp"

#include <algorithm>

namespace symrig::camera {
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

FrameNumbers::Reading FrameNumbers::read(std::uint64_t id, std::optional<std::uint32_t> counter) {
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
  Reading reading{number, Step::first, 0, false};
  if (begun_) {
    reading.step = number == last_ ? Step::repeated : number < last_ ? Step::backwards : Step::next;
    if (number > highest_ + 1) {
      reading.step = Step::gap;
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
