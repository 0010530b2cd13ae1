// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/sim_peripherals.hpp"

#include <algorithm>
#include <utility>

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

SimPlaneProjector::SimPlaneProjector(const SimBoard& board, const SimPlaneProjectorConfig& config)
    : config_(config),
      tick_hz_(board.config().tick_hz),
      origin_(board.now()),
      period_(ticks_of(config.period_ns)),
      lead_(ticks_of(config.frame_lead_ns)) {
  const int frame = board.line(config.frame_line), plane_line = board.line(config.plane_line);
  const std::uint64_t refresh = tick_hz_ / config.refresh_hz;
  events_.push_back({0, frame, true, -1, false});
  events_.push_back({lead_ / 2, frame, false, -1, false});
  int last = 0;
  for (int k = 0; k < config.planes; ++k) {
    const std::uint64_t begin = lead_ + static_cast<std::uint64_t>(k) * period_;
    if (begin + period_ >= refresh) break;
    if (k > 0) {
      const std::uint64_t early = begin - period_ / 8;
      events_.push_back({early - ticks_of(2'000), plane_line, false, k, true});
      events_.push_back({early, plane_line, true, k, true});
      events_.push_back({begin - ticks_of(20'000), plane_line, false, k - 1, false});
    }
    events_.push_back({begin, plane_line, true, k, false});
    last = k;
  }
  const std::uint64_t dark = lead_ + static_cast<std::uint64_t>(last + 1) * period_;
  events_.push_back({dark - ticks_of(20'000), plane_line, false, last, false});
}

std::uint64_t SimPlaneProjector::ticks_of(std::uint64_t nanoseconds) const {
  return nanoseconds * (tick_hz_ / 1'000'000) / 1000;
}

std::uint64_t SimPlaneProjector::refresh_tick(std::uint64_t number) const {
  return origin_ + number * tick_hz_ / config_.refresh_hz;
}

void SimPlaneProjector::outputs_changed(std::uint64_t /*tick*/, std::uint32_t /*levels*/,
                                        SimBoard& /*board*/) {}

std::uint64_t SimPlaneProjector::next_event() const {
  return refresh_tick(refresh_) + events_[next_].offset;
}

bool SimPlaneProjector::happens(const Event& event) const {
  if (event.plane < 0) return !faults.frames.contains(refresh_);
  const std::pair at(refresh_, event.plane);
  return event.glitch ? faults.glitches.contains(at) : !faults.planes.contains(at);
}

void SimPlaneProjector::on_event(std::uint64_t tick, SimBoard& board) {
  const Event& event = events_[next_];
  if (tick < stopped_at_ && happens(event)) board.set_input(event.line, event.level);
  if (++next_ < events_.size()) return;
  next_ = 0;
  ++refresh_;
}

std::uint64_t SimPlaneProjector::show(std::int64_t index, SimBoard& board) {
  const std::uint64_t number = refresh_ + (next_ > 0 ? 1 : 0);
  const std::uint64_t tick = refresh_tick(number);
  board.advance_to(tick + 1);  // the host hears of the refresh after its edge
  pictures_.push_back({number + static_cast<std::uint64_t>(config_.latency), index});
  return tick;
}

SimPlaneProjector::Flip SimPlaneProjector::play(const std::vector<std::int64_t>& order, SimBoard& board) {
  const std::uint64_t tick = show(order.front(), board);
  std::uint64_t refresh = pictures_.back().from - static_cast<std::uint64_t>(config_.latency);
  const std::uint64_t first = refresh;
  flips_ = {{first, tick, order.front()}};
  while (++refresh - first < order.size()) {
    const std::int64_t picture = order[refresh - first];
    while (faults.flips.contains(refresh)) ++refresh;
    flips_.push_back({refresh, refresh_tick(refresh), picture});
    pictures_.push_back({refresh + static_cast<std::uint64_t>(config_.latency), picture});
  }
  return flips_.front();
}

std::vector<SimPlaneProjector::Flip> SimPlaneProjector::played(SimBoard& board) {
  if (!flips_.empty() && flips_.back().tick > board.now()) board.advance_to(flips_.back().tick + 1);
  return std::exchange(flips_, {});
}

std::int64_t SimPlaneProjector::picture_in(std::uint64_t refresh) const {
  const auto after =
      std::upper_bound(pictures_.begin(), pictures_.end(), refresh,
                       [](std::uint64_t r, const Picture& picture) { return r < picture.from; });
  return after == pictures_.begin() ? -1 : (after - 1)->index;
}

int SimPlaneProjector::plane_in(std::uint64_t refresh, int place) const {
  if (faults.runs_free)
    return static_cast<int>((refresh + static_cast<std::uint64_t>(place)) %
                            static_cast<std::uint64_t>(config_.planes));
  return faults.order.empty() ? place : faults.order[static_cast<std::size_t>(place)];
}

std::vector<SimPlaneProjector::Lit> SimPlaneProjector::lit(std::uint64_t begin, std::uint64_t end) const {
  std::vector<Lit> all;
  if (end <= origin_) return all;
  const std::uint64_t first = (begin - std::min(begin, origin_)) * config_.refresh_hz / tick_hz_;
  for (std::uint64_t number = first > 0 ? first - 1 : 0; refresh_tick(number) < end; ++number) {
    const std::int64_t picture = picture_in(number);
    for (int k = 0; k < config_.planes && picture >= 0; ++k) {
      const std::uint64_t from = refresh_tick(number) + lead_ + static_cast<std::uint64_t>(k) * period_;
      const std::uint64_t to = std::min({from + period_, refresh_tick(number + 1), stopped_at_});
      const std::uint64_t a = std::max(begin, from), b = std::min(end, to);
      const int plane = plane_in(number, k);
      if (a < b && plane >= 0) all.push_back({picture, plane, b - a});
    }
  }
  return all;
}

SimCamera::SimCamera(const SimBoard& board, const SimCameraConfig& config)
    : trigger_(board.line(config.trigger_line)),
      strobe_(board.line(config.strobe_line)),
      readout_(ticks_of_us(config.readout_us, board.config().tick_hz)),
      delay_(ticks_of_us(config.delay_us, board.config().tick_hz)),
      overlap_(config.overlap) {}

void SimCamera::set_trigger(std::uint64_t delay_us, bool overlap, const SimBoard& board) {
  delay_ = ticks_of_us(delay_us, board.config().tick_hz);
  overlap_ = overlap;
}

void SimCamera::outputs_changed(std::uint64_t tick, std::uint32_t levels, SimBoard& board) {
  const bool high = level_of(levels, trigger_);
  if (high == high_) return;
  high_ = high;
  if (high && (taken_ || (!overlap_ && tick < busy_until_))) {
    ++missed_;
    ignoring_ = true;
  } else if (high) {
    taken_ = true;
    opens_ = tick + delay_;
  } else if (!std::exchange(ignoring_, false)) {
    closes_ = tick + delay_;
  }
  if (delay_ == 0) on_event(tick, board);
}

void SimCamera::on_event(std::uint64_t tick, SimBoard& board) {
  if (opens_ <= tick) {
    begin_ = std::exchange(opens_, kNever);
    board.set_input(strobe_, true);
  }
  if (closes_ > tick) return;
  const std::uint64_t end = std::exchange(closes_, kNever);
  taken_ = false;
  board.set_input(strobe_, false);
  if (end < busy_until_) {
    ++missed_;
    return;
  }
  busy_until_ = end + readout_;
  frames_.push_back({begin_, end});
}

void SimCamera::reset() {
  frames_.clear();
  missed_ = 0;
}

}  // namespace symrig::board_sim
