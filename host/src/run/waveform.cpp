// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/waveform.hpp"

#include <algorithm>
#include <utility>

namespace symrig {

Waveform waveform(const Timeline& plan, const BoardInfo& board, std::string name) {
  Waveform out{std::move(name), plan.rate, plan.start, plan.end, plan.initial_levels, {}, {}, {}};
  std::uint32_t moved = 0;
  for (const PlannedEdge& edge : plan.edges) {
    moved |= 1U << static_cast<unsigned>(edge.line);
    out.edges.push_back({edge.line, edge.level, edge.tick});
  }
  for (std::size_t k = 0; k < board.lines.size(); ++k) {
    if (((moved >> k) & 1U) == 0) continue;
    out.lines.push_back(static_cast<int>(k));
    out.names.push_back(board.lines[k].name);
  }
  return out;
}

}  // namespace symrig
