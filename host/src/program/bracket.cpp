// SPDX-License-Identifier: Apache-2.0
#include "program/timing.hpp"
#include "symrig/program/compile.hpp"

#include <algorithm>
#include <cmath>
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

namespace symrig::program {
namespace {

constexpr double kLongest = 1e15;  // ns, as in program files

std::vector<Nanoseconds> each_once(const std::vector<Nanoseconds>& all) {
  std::vector<Nanoseconds> once;
  for (const Nanoseconds one : all)
    if (std::find(once.begin(), once.end(), one) == once.end()) once.push_back(one);
  return once;
}

std::vector<Nanoseconds> legalized(const std::vector<Nanoseconds>& bracket, const Legalize& legalize) {
  std::vector<Nanoseconds> legal;
  legal.reserve(bracket.size());
  for (const Nanoseconds exposure : bracket) legal.push_back(legalize(exposure));
  return each_once(legal);
}

Nanoseconds times(Nanoseconds exposure, double factor) {
  return Nanoseconds{
      std::llround(std::min(kLongest, std::round(static_cast<double>(exposure.count()) * factor)))};
}

}  // namespace

std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least,
                                        const Legalize& legalize) {
  const std::vector<Nanoseconds> once = each_once(bracket);
  std::vector<Nanoseconds> legal = legalized(once, legalize);
  if (once.empty() || legal.size() == once.size()) return legal;
  const Nanoseconds shortest = std::max(*std::min_element(once.begin(), once.end()), Nanoseconds{1});
  const double factor = static_cast<double>(least.count()) / static_cast<double>(shortest.count());
  if (!(factor > 1)) return legal;
  std::vector<Nanoseconds> longer;
  longer.reserve(once.size());
  for (const Nanoseconds exposure : once) longer.push_back(std::max(times(exposure, factor), least));
  longer = legalized(longer, legalize);
  return longer.size() > legal.size() ? longer : legal;
}

std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least) {
  return longer_bracket(bracket, least, [least](Nanoseconds exposure) { return std::max(exposure, least); });
}

}  // namespace symrig::program
