// SPDX-License-Identifier: Apache-2.0
#include "engine.hpp"

#include <algorithm>

namespace symrig::boards {

void Engine::push(const hal::Segment& segment) {
  queue_[(first_ + count_) % queue_.size()] = segment;
  ++count_;
  closed_ = false;
}

hal::Tick Engine::start(hal::Tick tick) {
  playing_ = true;
  underrun_ = false;
  played_ = 0;
  waits_.clear();
  next_ = std::max(tick, pins_.now());
  const hal::Tick begin = next_;
  if (begin == pins_.now()) step();
  return begin;
}

void Engine::step() {
  if (waiting_) return end_wait(next_, true);
  if (count_ == 0) {
    playing_ = false;
    underrun_ = !closed_;
    if (underrun_) drive(safe_);
    return;
  }
  const hal::Segment segment = queue_[first_];
  first_ = (first_ + 1) % queue_.size();
  --count_;
  if (segment.until != hal::Until::elapsed) return begin_wait(segment);
  ++played_;
  next_ += segment.ticks;
  drive(segment.levels);
}

void Engine::begin_wait(const hal::Segment& wait) {
  waiting_ = true;
  wait_ = wait;
  const hal::Tick begin = next_;
  next_ += wait.ticks;
  // An edge of this very tick counts, whether it was seen before the wait began or after.
  const LastEdge& last = last_edges_.at(wait.line);
  if (last.tick == begin && ends_wait(wait.line, last.level)) end_wait(begin, false);
}

bool Engine::ends_wait(std::uint8_t line, bool level) const {
  if (!waiting_ || line != wait_.line) return false;
  return wait_.until == hal::Until::both || (wait_.until == hal::Until::rising) == level;
}

void Engine::end_wait(hal::Tick tick, bool timed_out) {
  waiting_ = false;
  if (timed_out && wait_.stop_on_timeout) {
    waits_.push_back({tick, tick, true});
    return stop_safe();
  }
  next_ = tick + wait_latency_;
  waits_.push_back({tick, next_, timed_out});
}

bool Engine::pop_wait(hal::WaitOutcome& outcome) {
  if (waits_.empty()) return false;
  outcome = waits_.front();
  waits_.pop_front();
  return true;
}

void Engine::input_changed(std::uint8_t line, bool level) {
  last_edges_.at(line) = {pins_.now(), level};
  if (ends_wait(line, level)) end_wait(pins_.now(), false);
  check_trips();
}

void Engine::set_trips(std::uint32_t lines, std::uint32_t levels) {
  trip_lines_ = lines;
  trip_levels_ = levels;
  tripped_ = 0;
  check_trips();
}

void Engine::check_trips() {
  const std::uint32_t at_level = ~(pins_.levels() ^ trip_levels_) & trip_lines_;
  if (at_level == 0) return;
  tripped_ |= at_level;
  stop_safe();
}

/// The outcomes of waits stay to be told.
void Engine::stop() {
  playing_ = false;
  waiting_ = false;
  count_ = 0;
}

void Engine::stop_safe() {
  stop();
  drive(safe_);
}

void Engine::force(std::uint32_t levels) {
  stop();
  underrun_ = false;
  closed_ = false;
  drive(levels);
}

void Engine::drive(std::uint32_t levels) {
  levels_ = levels;
  pins_.drive(levels);
}

}  // namespace symrig::boards
