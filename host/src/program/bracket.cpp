// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/bracket.hpp"

#include <algorithm>
#include <utility>

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

namespace {

Result<CompiledProgram> compile_scan(const RigSetup& rig, const BoardInfo& board, Scan scan) {
  ProgramFile file;
  file.rig = rig;
  file.scan = std::move(scan);
  Compilation compiled = compile_program(file, board);
  if (compiled.program) return *std::move(compiled.program);
  const auto worst = std::ranges::find(compiled.findings, Severity::error, &FileFinding::severity);
  return Error{code_of(*worst), worst->what, "the nearest legal choice: " + worst->alternative};
}

}  // namespace

Result<CompiledProgram> compile_planes(const RigSetup& rig, const BoardInfo& board,
                                       std::span<const PlaneExposure> exposures,
                                       std::optional<Nanoseconds> gap) {
  if (exposures.empty()) return Error{ErrorCode::bad_argument, "there are no photographs to take", ""};
  std::vector<std::vector<Nanoseconds>> brackets;
  brackets.reserve(exposures.size());
  for (const PlaneExposure& one : exposures) brackets.push_back({one.exposure});
  Scan scan = scan_of_brackets(brackets, gap);
  scan.plane_exposures.assign(exposures.begin(), exposures.end());
  return compile_scan(rig, board, std::move(scan));
}

Result<CompiledProgram> compile_brackets(const RigSetup& rig, const BoardInfo& board,
                                         std::span<const std::vector<Nanoseconds>> brackets,
                                         std::optional<Nanoseconds> gap) {
  if (brackets.empty()) return Error{ErrorCode::bad_argument, "there are no photographs to take", ""};
  if (std::ranges::any_of(brackets, [](const auto& bracket) { return bracket.empty(); }))
    return Error{ErrorCode::bad_argument, "a bracket has no exposures", "give at least one"};
  return compile_scan(rig, board, scan_of_brackets(brackets, gap));
}

}  // namespace symrig
