// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/lint.hpp"

#include "board/session/line_setup.hpp"
#include "board/session/refusal.hpp"
#include "symrig/protocol/check_program.hpp"

#include <fmt/format.h>

namespace symrig {

std::string Finding::line_of_text() const {
  const std::string where = line.empty() ? "" : fmt::format("line '{}' ", line);
  return fmt::format("record {}: {}{}: {}; {}", record, where, rule, what, alternative);
}

std::vector<Finding> lint(const Program& program, const BoardInfo& board, std::span<const LineConfig> lines) {
  std::vector<Finding> findings;
  const auto config = board::line_setup(board, lines);
  if (!config) {
    findings.push_back({"config", 0, "", config.error().what, config.error().hint});
    return findings;
  }
  protocol::ProgramTiming timing;
  protocol::check_program({{program.bytes().data(), program.bytes().size()}},
                          board::program_rules(board, *config), timing,
                          [&](const protocol::Violation& violation) {
                            findings.push_back(board::explain(violation, board));
                            return true;
                          });
  return findings;
}

}  // namespace symrig
