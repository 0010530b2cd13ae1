// SPDX-License-Identifier: Apache-2.0
#include "program/moves.hpp"

namespace symrig::program {

using Kind = Move::Kind;

void MoveList::set(std::string_view line, bool on, int place) {
  const RigLine* rig_line = rig_->find(line);
  const bool active_low = rig_line != nullptr && rig_line->active_low;
  moves_.push_back(
      {.kind = Kind::set, .line = board_->line(line), .level = on != active_low, .place = place});
}

void MoveList::is_off(std::string_view line, int place) {
  set(line, false, place);
  moves_.back().at_once = true;
}

void MoveList::hold(Ticks ticks, int place) {
  if (ticks.count > 0) moves_.push_back({.kind = Kind::hold, .ticks = ticks, .place = place});
}

void MoveList::pulse(std::string_view line, Ticks width, int place) {
  set(line, true, place);
  hold(width, place);
  set(line, false, place);
}

void MoveList::wait(std::string_view line, EdgeKind edge, Nanoseconds timeout, OnTimeout action, int place) {
  moves_.push_back({.kind = Kind::wait,
                    .line = board_->line(line),
                    .ticks = board_->rate.ticks(timeout),
                    .edge = edge,
                    .on_timeout = action,
                    .place = place});
}

void MoveList::mark(std::uint64_t id, int place) {
  moves_.push_back({.kind = Kind::mark, .count = id, .place = place});
}

void MoveList::loop(std::uint64_t rounds, int place) {
  moves_.push_back({.kind = Kind::loop, .count = rounds, .place = place});
}

void MoveList::end_loop(int place) {
  moves_.push_back({.kind = Kind::end_loop, .place = place});
}

Ticks MoveList::ticks_up(Nanoseconds time) const {
  const Ticks nearest = board_->rate.ticks(time);
  return board_->rate.nanoseconds(nearest) < time ? nearest + Ticks{1} : nearest;
}

}  // namespace symrig::program
