// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/guard.hpp"

namespace symrig::firmware {

using hal::Tick;
using protocol::LineConfig;
using protocol::Rule;

void Guard::configure(const protocol::BoardConfig& config, uint32_t levels, Tick now) {
  config_ = config;
  const uint32_t watched_before = watched_;
  watched_ = 0;
  for (unsigned k = 0; k < protocol::kMaxOutputs; ++k) {
    const LineConfig& line = config_.lines[k];
    if (!line.configured || !line.output || !line.limited()) continue;
    watched_ |= uint32_t{1} << k;
    const bool on = (((levels >> k) & 1U) != 0) != line.safe_level;
    // A new configuration does not cool a hot lamp: keep its last pulse.
    const bool known = ((watched_before >> k) & 1U) != 0 && watches_[k].on == on;
    if (!known) watches_[k] = {on, true, now, 0};
  }
}

bool Guard::edge(const hal::CapturedEdge& edge, Breach& breach) {
  if (edge.line >= protocol::kMaxOutputs || !watches(edge.line)) return false;
  Watch& watch = watches_[edge.line];
  const LineConfig& line = config_.lines[edge.line];
  const bool on = edge.level != line.safe_level;
  if (on == watch.on) return false;
  const Tick length = edge.tick - watch.since;
  const Watch before = watch;
  watch = {on, false, edge.tick, on ? 0 : length};
  if (!on) {
    breach = {Rule::max_on, edge.line, edge.tick};
    return line.max_on != 0 && length > line.max_on;
  }
  if (before.rested) return false;
  breach = {length < line.min_off ? Rule::min_off : Rule::duty, edge.line, edge.tick};
  return length < line.min_off || length < protocol::rest_after(before.pulse, line.max_duty_permille);
}

bool Guard::check(Tick now, Breach& breach) const {
  for (uint8_t k = 0; k < protocol::kMaxOutputs; ++k) {
    if (!watches(k) || !watches_[k].on || config_.lines[k].max_on == 0) continue;
    if (now - watches_[k].since <= config_.lines[k].max_on) continue;
    breach = {Rule::max_on, k, now};
    return true;
  }
  return false;
}

Tick Guard::next_deadline() const {
  Tick deadline = hal::kNever;
  for (unsigned k = 0; k < protocol::kMaxOutputs; ++k) {
    if (!watches(k) || !watches_[k].on || config_.lines[k].max_on == 0) continue;
    const Tick tick = watches_[k].since + config_.lines[k].max_on + 1;
    if (tick < deadline) deadline = tick;
  }
  return deadline;
}

Tick Guard::rest_needed(unsigned line) const {
  const Tick rest = protocol::rest_after(watches_[line].pulse, config_.lines[line].max_duty_permille);
  return rest > config_.lines[line].min_off ? rest : config_.lines[line].min_off;
}

int Guard::cooling_line(uint32_t mask, Tick tick, Tick& needed) const {
  for (unsigned k = 0; k < protocol::kMaxOutputs; ++k) {
    if (((mask >> k) & 1U) == 0 || !watches(k) || watches_[k].on || watches_[k].rested) continue;
    const Tick ready = watches_[k].since + rest_needed(k);
    if (ready <= tick) continue;
    needed = ready - tick;
    return static_cast<int>(k);
  }
  return -1;
}

}  // namespace symrig::firmware
