// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/delivery.hpp"

#include <algorithm>
#include <utility>

namespace symrig::bench_vm {

namespace {

/// A swapped frame without a successor is delivered after this time.
constexpr Nanoseconds kOvertaking{1'000'000'000};

DeliveredFrame as_exposed(FinishedFrame frame, const FaultRates& rates, bool by_camera) {
  DeliveredFrame delivered;
  delivered.frame = frame.frame;
  delivered.fault = fault_of(rates, frame.frame);
  delivered.due = frame.ready;
  delivered.stamp = frame.stamp + jitter_of(rates, frame.frame);
  delivered.damaged = delivered.fault == FrameFault::damage;
  delivered.codes = std::move(frame.codes);
  delivered.open = frame.open;
  if (delivered.fault == FrameFault::late && !by_camera) {
    delivered.due += rates.late_by;
    delivered.stamp += rates.late_by;
  }
  return delivered;
}

/// A damaged frame lacks its second half.
Codes torn(const Codes& codes) {
  auto half = std::make_shared<std::vector<std::uint16_t>>(*codes);
  std::fill(half->begin() + static_cast<std::ptrdiff_t>(half->size() / 2), half->end(), std::uint16_t{0});
  return half;
}

}  // namespace

void Delivery::add(FinishedFrame finished) {
  DeliveredFrame frame = as_exposed(std::move(finished), rates_, by_camera_);
  if (frame.damaged) frame.codes = torn(frame.codes);
  if (frame.fault == FrameFault::drop) {
    ++dropped_;
    if (rates_.counted) ++skip_;
    return;
  }
  if (frame.fault == FrameFault::swap && !by_camera_ && !held_) {
    frame.due += kOvertaking;
    held_ = std::move(frame);
    return;
  }
  if (frame.fault == FrameFault::duplicate) enqueue(frame);
  const Nanoseconds due = frame.due;
  enqueue(std::move(frame));
  if (!held_) return;
  held_->due = due;
  enqueue(*std::exchange(held_, std::nullopt));
}

void Delivery::enqueue(DeliveredFrame frame) {
  frame.skip = std::exchange(skip_, 0);
  frame.due = busy_until_ = std::max(frame.due, busy_until_);
  queue_.push_back(std::move(frame));
}

std::optional<Nanoseconds> Delivery::next_due() const {
  if (!queue_.empty()) return queue_.front().due;
  if (held_) return held_->due;
  return std::nullopt;
}

std::vector<DeliveredFrame> Delivery::take_due(Nanoseconds now) {
  if (queue_.empty() && held_ && held_->due <= now) enqueue(*std::exchange(held_, std::nullopt));
  std::vector<DeliveredFrame> due;
  while (!queue_.empty() && queue_.front().due <= now) {
    due.push_back(std::move(queue_.front()));
    queue_.pop_front();
  }
  return due;
}

}  // namespace symrig::bench_vm
