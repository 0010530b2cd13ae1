// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// One broken rule. The rules are the board's own: what lint() passes, a commit accepts.
struct Finding {
  std::string rule;         ///< "min_dwell", "max_on", "loop_depth", ...: as in protocol/PROTOCOL.md
  std::size_t record = 0;   ///< where in the program
  std::string line;         ///< line concerned, empty if none
  std::string what;         ///< the breach with its numbers
  std::string alternative;  ///< the nearest legal choice

  /// "record 5: line 'lamp_enable' max_on: on for 2.000 s, limit 1.000 s; turn it off after at most 1.000 s"
  std::string line_of_text() const;
};

/// Checks a program against a board and the configuration of its lines. Work is bounded by the length of the
/// program, not by its duration. Empty: nothing to object to.
std::vector<Finding> lint(const Program& program, const BoardInfo& board, std::span<const LineConfig> lines);

}  // namespace symrig
