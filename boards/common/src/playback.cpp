// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/playback.hpp"

#include <algorithm>

namespace symrig::board_common {

using hal::Segment;
using hal::Tick;
using hal::Until;

void Playback::push(const Segment& segment) {
  queue_.push(segment);
  closed_ = false;
}

Tick Playback::start(Tick tick, Tick now) {
  playing_ = true;
  underrun_ = false;
  waiting_ = false;
  played_ = 0;
  late_ = 0;
  outcomes_.clear();
  next_ = std::max(tick, now);
  const Tick begin = next_;
  if (tripped_ != 0) {
    stop_safe();
  } else {
    act(now);
  }
  return begin;
}

Tick Playback::due() const {
  if (!playing_) return hal::kNever;
  // An edge shortly before the time-out is known `input` ticks later.
  return waiting_ ? next_ + promise_.input : next_;
}

void Playback::act(Tick now) {
  if (due() > now) return;
  if (waiting_) return end_wait(next_, true);
  Segment segment;
  if (!queue_.pop(segment)) return run_dry();
  if (segment.until != Until::elapsed) return begin_wait(segment);
  play(segment, now);
}

/// A word that is later than its own end would be a shorter pulse than planned. It counts as an underrun.
void Playback::play(const Segment& segment, Tick now) {
  if (now >= next_ + segment.ticks) {
    underrun_ = true;
    stop_safe();
    return;
  }
  ++played_;
  const Tick plan = next_;
  next_ += segment.ticks;
  levels_ = segment.levels;
  if (sink_.put(segment.levels) > plan + promise_.lateness) ++late_;
}

void Playback::run_dry() {
  playing_ = false;
  underrun_ = !closed_;
  if (underrun_) stop_safe();
}

void Playback::begin_wait(const Segment& wait) {
  waiting_ = true;
  wait_ = wait;
  wait_begin_ = next_;
  next_ += wait.ticks;
  const std::size_t kept = std::min(recent_count_, kRecent);
  for (std::size_t k = recent_count_ - kept; k < recent_count_; ++k) {
    const hal::CapturedEdge& edge = recent_.at(k % kRecent);
    if (ends_wait(edge)) return end_wait(edge.tick, false);
  }
}

bool Playback::ends_wait(const hal::CapturedEdge& edge) const {
  if (!waiting_ || edge.line != wait_.line || edge.tick < wait_begin_ || edge.tick >= next_) return false;
  return wait_.until == Until::both || (wait_.until == Until::rising) == edge.level;
}

void Playback::end_wait(Tick tick, bool timed_out) {
  waiting_ = false;
  if (timed_out && wait_.stop_on_timeout) {
    const Tick safe_at = stop_safe();
    outcomes_.push({tick, safe_at, true});
    return;
  }
  next_ = tick + promise_.wait_latency;
  outcomes_.push({tick, next_, timed_out});
}

void Playback::input(const hal::CapturedEdge& edge) {
  recent_.at(recent_count_++ % kRecent) = edge;
  if (ends_wait(edge)) end_wait(edge.tick, false);
  const std::uint32_t bit = 1U << edge.line;
  if (((trip_levels_ & bit) != 0) == edge.level) check_trips(bit);
}

void Playback::inputs_are(std::uint32_t levels) {
  check_trips(~(levels ^ trip_levels_));
}

void Playback::set_trips(std::uint32_t lines, std::uint32_t levels, std::uint32_t inputs) {
  trip_lines_ = lines;
  trip_levels_ = levels;
  tripped_ &= lines;
  inputs_are(inputs);
}

void Playback::check_trips(std::uint32_t at_level) {
  if ((at_level & trip_lines_) == 0) return;
  tripped_ |= at_level & trip_lines_;
  stop_safe();
}

void Playback::fall() {
  underrun_ = playing_;
  stop_safe();
}

/// Keeps the outcomes of waits, which the firmware still has to read.
void Playback::stop() {
  playing_ = false;
  waiting_ = false;
  queue_.clear();
}

Tick Playback::stop_safe() {
  stop();
  levels_ = safe_;
  return sink_.put_all(levels_);
}

void Playback::force(std::uint32_t levels) {
  stop();
  underrun_ = false;
  closed_ = false;
  levels_ = tripped_ != 0 ? safe_ : levels;
  sink_.put_all(levels_);
}

}  // namespace symrig::board_common
