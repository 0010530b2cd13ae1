// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/delivery.hpp"

#include "sim/light/random.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace symrig::bench_vm {

namespace {

constexpr std::uint64_t kFaultKey = 0xfa017;
constexpr std::uint64_t kJitterKey = 0x177e4;
constexpr std::uint64_t kTriggerKey = 0x7219;

double draw(std::uint64_t stream, const FaultRates& rates, std::uint64_t frame) {
  return sim::unit_double(sim::combine(sim::combine(stream, rates.seed), frame));
}

}  // namespace

std::string_view name(FrameFault fault) {
  constexpr std::array<std::string_view, 6> kNames{"none", "drop", "duplicate", "late", "swap", "damage"};
  return kNames[static_cast<std::size_t>(fault)];
}

bool FaultRates::valid() const {
  const std::array shares{drop, duplicate, late, swap, damage};
  double sum = 0;
  for (const double share : shares) {
    if (!(share >= 0 && share <= 1)) return false;
    sum += share;
  }
  return sum <= 1 && drop_trigger >= 0 && drop_trigger <= 1 && late_by.count() >= 0 && jitter.count() >= 0;
}

FrameFault fault_of(const FaultRates& rates, std::uint64_t frame) {
  if (rates.drop_frame == frame) return FrameFault::drop;
  const std::array<std::pair<FrameFault, double>, 5> kinds{{{FrameFault::drop, rates.drop},
                                                            {FrameFault::duplicate, rates.duplicate},
                                                            {FrameFault::late, rates.late},
                                                            {FrameFault::swap, rates.swap},
                                                            {FrameFault::damage, rates.damage}}};
  double u = draw(kFaultKey, rates, frame);
  for (const auto& [fault, share] : kinds) {
    if (u < share) return fault;
    u -= share;
  }
  return FrameFault::none;
}

bool sees_trigger(const FaultRates& rates, std::uint64_t number) {
  return draw(kTriggerKey, rates, number) >= rates.drop_trigger;
}

Nanoseconds jitter_of(const FaultRates& rates, std::uint64_t frame) {
  if (rates.jitter.count() == 0) return Nanoseconds{0};
  constexpr double kEdge = 0x1p-54;  // keeps u inside (0, 1)
  const double z = sim::normal_quantile(draw(kJitterKey, rates, frame) * (1 - 2 * kEdge) + kEdge);
  return Nanoseconds{std::llround(z * static_cast<double>(rates.jitter.count()))};
}

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
