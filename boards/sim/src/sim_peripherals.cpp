// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/sim_peripherals.hpp"

#include <algorithm>

namespace symrig::board_sim {
namespace {

bool level_of(std::uint32_t levels, int line) {
  return line >= 0 && ((levels >> static_cast<unsigned>(line)) & 1U) != 0;
}

std::uint64_t ticks_of_us(std::uint64_t microseconds, std::uint64_t tick_hz) {
  return microseconds * tick_hz / 1'000'000;
}

}  // namespace

SimProjector::SimProjector(const SimBoard& board, const SimProjectorConfig& config)
    : trigger_(board.line(config.trigger_line)),
      vsync_(board.line(config.vsync_line)),
      tick_hz_(board.config().tick_hz),
      origin_(board.now()),
      refresh_hz_(config.refresh_hz),
      pulse_(std::max<std::uint64_t>(1, ticks_of_us(config.vsync_pulse_us, tick_hz_))) {}

/// Begin of refresh `number`, counted from 1. Computed from the number, so rounding errors do not add up.
std::uint64_t SimProjector::refresh_tick(std::uint64_t number) const {
  return origin_ + number * tick_hz_ / refresh_hz_;
}

void SimProjector::outputs_changed(std::uint64_t /*tick*/, std::uint32_t levels, SimBoard& /*board*/) {
  if (level_of(levels, trigger_) && !level_of(levels_, trigger_)) ++asked_;
  levels_ = levels;
}

std::uint64_t SimProjector::next_event() const {
  return vsync_high_ ? refresh_tick(refreshes_) + pulse_ : refresh_tick(refreshes_ + 1);
}

void SimProjector::on_event(std::uint64_t tick, SimBoard& board) {
  vsync_high_ = !vsync_high_;
  board.set_input(vsync_, vsync_high_);
  if (!vsync_high_) return;
  ++refreshes_;
  if (asked_ == 0) return;
  shown_ += asked_;
  asked_ = 0;
  changes_.push_back({tick, shown_});
}

std::int64_t SimProjector::pattern_at(std::uint64_t tick) const {
  const auto after = std::upper_bound(changes_.begin(), changes_.end(), tick,
                                      [](std::uint64_t t, const Change& change) { return t < change.tick; });
  return after == changes_.begin() ? -1 : (after - 1)->index;
}

void SimProjector::show(std::int64_t index, SimBoard& board) {
  const std::uint64_t tick = refresh_tick(refreshes_ + 1);
  board.advance_to(tick);
  shown_ = index;
  changes_.push_back({tick, index});
}

void SimProjector::reset() {
  shown_ = -1;
  asked_ = 0;
  changes_.clear();
}

SimCamera::SimCamera(const SimBoard& board, const SimCameraConfig& config)
    : trigger_(board.line(config.trigger_line)),
      strobe_(board.line(config.strobe_line)),
      readout_(ticks_of_us(config.readout_us, board.config().tick_hz)) {}

void SimCamera::outputs_changed(std::uint64_t tick, std::uint32_t levels, SimBoard& board) {
  const bool high = level_of(levels, trigger_);
  if (high == high_) return;
  high_ = high;
  if (high && tick < busy_until_) {
    ++missed_;
  } else if (high) {
    exposing_ = true;
    begin_ = tick;
    board.set_input(strobe_, true);
  } else if (exposing_) {
    exposing_ = false;
    busy_until_ = tick + readout_;
    frames_.push_back({begin_, tick});
    board.set_input(strobe_, false);
  }
}

void SimCamera::on_event(std::uint64_t /*tick*/, SimBoard& /*board*/) {}

void SimCamera::reset() {
  frames_.clear();
  missed_ = 0;
}

}  // namespace symrig::board_sim
