// SPDX-License-Identifier: Apache-2.0
// Look-ups in the description of a board's lines.
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

bool RigWiring::is_active_low(std::string_view line) const {
  return std::find(active_low.begin(), active_low.end(), line) != active_low.end();
}

RigWiring wiring_of(const RigSetup& rig) {
  const auto line_of = [&rig](RigRole role) {
    const RigLine* line = rig.with_role(role);
    return line == nullptr ? std::string() : line->config.line;
  };
  RigWiring wiring{line_of(RigRole::projector),
                   line_of(RigRole::vsync),
                   line_of(RigRole::camera),
                   line_of(RigRole::strobe),
                   {},
                   rig.projector.refresh};
  for (const RigLine& line : rig.lines)
    if (line.active_low) wiring.active_low.push_back(line.config.line);
  return wiring;
}

}  // namespace symrig
