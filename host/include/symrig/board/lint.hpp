// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// One broken rule. The rules are those of the board: if lint() finds nothing, the board accepts the commit.
struct Finding {
  std::string rule;         ///< "min_dwell", "max_on", "loop_depth", ...: as in protocol/PROTOCOL.md
  std::size_t record = 0;   ///< index of the record in the program
  std::string line;         ///< the line's name, empty if the rule concerns none
  std::string what;         ///< the problem with its numbers
  std::string alternative;  ///< the nearest legal choice

  /// "record 5: line 'lamp_enable' max_on: on for 2.000 s, limit 1.000 s; turn it off after at most 1.000 s"
  std::string line_of_text() const;
};

/// Checks a program against a board and the configuration of its lines. The cost grows with the length of the
/// program, not with its duration. Empty if no rule is broken.
std::vector<Finding> lint(const Program& program, const BoardInfo& board, std::span<const LineConfig> lines);

}  // namespace symrig
