// SPDX-License-Identifier: Apache-2.0
#include "board/session/line_setup.hpp"

#include "board/session/names.hpp"
#include "symrig/protocol/messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig::board {
namespace {

std::uint8_t role_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, symrig_wire_LineRole>, 5> kRoles{
      {{"projector_trigger", symrig_wire_LineRole_LINE_ROLE_PROJECTOR_TRIGGER},
       {"camera_trigger", symrig_wire_LineRole_LINE_ROLE_CAMERA_TRIGGER},
       {"lamp_enable", symrig_wire_LineRole_LINE_ROLE_LAMP_ENABLE},
       {"vsync", symrig_wire_LineRole_LINE_ROLE_VSYNC},
       {"camera_strobe", symrig_wire_LineRole_LINE_ROLE_CAMERA_STROBE}}};
  for (const auto& [known, role] : kRoles)
    if (known == name) return static_cast<std::uint8_t>(role);
  return symrig_wire_LineRole_LINE_ROLE_GENERAL;
}

bool has_limits(const LineConfig& line) {
  return line.max_on.count() != 0 || line.min_off.count() != 0 || line.max_duty != 1;
}

Result<void> check(const LineConfig& line, const LineInfo& wired) {
  const bool output = wired.output;
  const auto bad = [&line](const char* what, const char* hint) {
    return Error{ErrorCode::bad_argument, fmt::format("line '{}': {}", line.line, what), hint};
  };
  if (line.max_on.count() < 0 || line.min_off.count() < 0)
    return bad("a limit is negative", "give max_on and min_off as durations, 0 for none");
  if (!(line.max_duty >= 0.001 && line.max_duty <= 1))
    return bad("max_duty is out of range", "give a share from 0.001 to 1 (1 = no limit)");
  if (line.trip_level && !wired.trips && !output)
    return bad("this board cannot stop on a change of this input",
               "use a line whose `trips` is true in `symrig info`");
  if (output && line.trip_level) return bad("an output cannot have a trip level", "remove it");
  if (output && line.hazard == Hazard::laser && line.max_on.count() == 0)
    return bad("a laser line needs a limit on its time on", "give max_on");
  if (!output && (has_limits(line) || line.safe_level))
    return bad("an input cannot have limits or a safe level", "remove them");
  return {};
}

std::uint64_t limit_ticks(const BoardInfo& info, Nanoseconds limit) {
  return std::min(info.rate.ticks(limit).count, protocol::kMaxDuration);
}

void fill(const BoardInfo& info, const LineConfig& line, protocol::LineConfig& config) {
  config.hazard = static_cast<std::uint8_t>(line.hazard);
  config.safe_level = line.safe_level;
  config.capture = line.capture;
  config.max_on = limit_ticks(info, line.max_on);
  config.min_off = limit_ticks(info, line.min_off);
  // Rounded down: the board must not allow more than the user asked for.
  const auto permille = static_cast<std::uint16_t>(std::floor(line.max_duty * 1000 + 1e-9));
  config.max_duty_permille = permille >= 1000 ? 0 : permille;
  if (!line.trip_level) return;
  config.role = symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
  config.trip_level = *line.trip_level;
}

}  // namespace

Result<protocol::BoardConfig> line_setup(const BoardInfo& info, std::span<const LineConfig> lines) {
  protocol::BoardConfig config;
  for (std::size_t k = 0; k < info.lines.size() && k < protocol::kMaxLines; ++k) {
    config.lines[k].configured = true;
    config.lines[k].output = info.lines[k].output;
    config.lines[k].role = role_of(info.lines[k].name);
  }
  std::uint32_t named = 0;
  for (const LineConfig& line : lines) {
    const int k = info.line(line.line);
    if (k < 0)
      return Error{ErrorCode::unknown_name, fmt::format("the board has no line '{}'", line.line),
                   line_hint(info, line.line)};
    const std::uint32_t bit = 1U << static_cast<unsigned>(k);
    if ((named & bit) != 0)
      return Error{ErrorCode::bad_argument, fmt::format("line '{}' is configured twice", line.line),
                   "name each line once"};
    named |= bit;
    protocol::LineConfig& target = config.lines[k];
    SYMRIG_CHECK(check(line, info.lines[k]));
    fill(info, line, target);
  }
  return config;
}

protocol::ProgramRules program_rules(const BoardInfo& info, const protocol::BoardConfig& config) {
  protocol::ProgramRules rules;
  rules.config = &config;
  rules.min_dwell = static_cast<std::uint32_t>(info.min_dwell.count);
  rules.max_dwell = static_cast<std::uint32_t>(info.max_dwell.count);
  rules.wait_latency = static_cast<std::uint32_t>(info.wait_latency.count);
  rules.max_bytes = info.program_bytes;
  rules.loop_depth = info.loop_depth;
  for (std::size_t k = 0; k < info.lines.size() && k < protocol::kMaxLines; ++k)
    rules.no_waits[k] = static_cast<std::uint8_t>(7U & ~info.lines[k].waits);
  rules.queue_segments = info.queue_segments;
  rules.refill_ticks = info.refill_ticks;
  rules.poll_ticks = info.poll_ticks;
  return rules;
}

}  // namespace symrig::board
