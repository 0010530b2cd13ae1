// SPDX-License-Identifier: Apache-2.0
// Look-ups in the description of a board's lines.
#include "program/timing.hpp"
#include "symrig/program/program_file.hpp"

#include <algorithm>

namespace symrig {

const RigLine* RigSetup::with_role(RigRole role) const {
  const auto found =
      std::find_if(lines.begin(), lines.end(), [role](const RigLine& line) { return line.role == role; });
  return found == lines.end() ? nullptr : &*found;
}

const RigLine* RigSetup::find(std::string_view line) const {
  const auto found = std::find_if(lines.begin(), lines.end(),
                                  [line](const RigLine& one) { return one.config.line == line; });
  return found == lines.end() ? nullptr : &*found;
}

std::string RigSetup::line_name(RigRole role) const {
  const RigLine* line = with_role(role);
  return line == nullptr ? std::string() : line->config.line;
}

bool RigSetup::is_active_low(RigRole role) const {
  const RigLine* line = with_role(role);
  return line != nullptr && line->active_low;
}

RigSetup RigSetup::without(RigRole role) const {
  RigSetup rig = *this;
  for (RigLine& line : rig.lines)
    if (line.role == role) line.role = RigRole::general;
  return rig;
}

bool RigWiring::is_active_low(std::string_view line) const {
  return std::find(active_low.begin(), active_low.end(), line) != active_low.end();
}

RigWiring wiring_of(const RigSetup& rig) {
  RigWiring wiring{rig.line_name(RigRole::projector),
                   rig.line_name(RigRole::vsync),
                   rig.line_name(RigRole::camera),
                   rig.line_name(RigRole::strobe),
                   {},
                   rig.projector.refresh,
                   program::shortest_gap(rig.camera)};
  for (const RigLine& line : rig.lines)
    if (line.active_low) wiring.active_low.push_back(line.config.line);
  return wiring;
}

}  // namespace symrig
