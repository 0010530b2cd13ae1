// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/bracket.hpp"

#include <algorithm>

namespace symrig {
namespace {

/// The linter's rules about lines are about names; all others are about values.
ErrorCode code_of(const FileFinding& finding) {
  return finding.rule == "line.unknown" ? ErrorCode::unknown_name : ErrorCode::bad_argument;
}

}  // namespace

Scan scan_of_brackets(std::span<const std::vector<Nanoseconds>> brackets, std::optional<Nanoseconds> gap) {
  Scan scan;
  scan.gap = gap;
  scan.lines_as_wired = true;
  for (const std::vector<Nanoseconds>& bracket : brackets) {
    if (!scan.patterns.empty() && scan.patterns.back().bracket == bracket) {
      ++scan.patterns.back().count;
    } else {
      scan.patterns.push_back({.bracket = bracket});
    }
  }
  return scan;
}

Result<CompiledProgram> compile_brackets(const RigSetup& rig, const BoardInfo& board,
                                         std::span<const std::vector<Nanoseconds>> brackets,
                                         std::optional<Nanoseconds> gap) {
  if (brackets.empty()) return Error{ErrorCode::bad_argument, "there are no photographs to take", ""};
  if (std::ranges::any_of(brackets, [](const auto& bracket) { return bracket.empty(); }))
    return Error{ErrorCode::bad_argument, "a bracket has no exposures", "give at least one"};
  ProgramFile file;
  file.rig = rig;
  file.scan = scan_of_brackets(brackets, gap);
  Compilation compiled = compile_program(file, board);
  if (compiled.program) return *std::move(compiled.program);
  const auto worst = std::ranges::find(compiled.findings, Severity::error, &FileFinding::severity);
  return Error{code_of(*worst), worst->what, "the nearest legal choice: " + worst->alternative};
}

}  // namespace symrig
