// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/compile.hpp"

#include "program/passes.hpp"
#include "program/timing.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/internal/board_forms.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/board/program.hpp"
#include "symrig/program/timeline.hpp"
#include "symrig/protocol/check_program.hpp"

#include <algorithm>
#include <set>
#include <tuple>

#include <fmt/format.h>

namespace symrig::program {

bool LintFindings::fatal() const {
  return std::any_of(all_.begin(), all_.end(),
                     [](const FileFinding& finding) { return finding.severity == Severity::error; });
}

std::vector<FileFinding> LintFindings::take() {
  const auto key = [](const FileFinding& f) { return std::tie(f.place, f.rule, f.what); };
  std::stable_sort(all_.begin(), all_.end(),
                   [&key](const FileFinding& a, const FileFinding& b) { return key(a) < key(b); });
  all_.erase(std::unique(all_.begin(), all_.end(),
                         [&key](const FileFinding& a, const FileFinding& b) { return key(a) == key(b); }),
             all_.end());
  return std::move(all_);
}

std::string setting(std::string_view key, Nanoseconds value) {
  return fmt::format("{} = \"{}\"", key, base::duration_text(value));
}

std::string bracket_setting(const std::vector<Nanoseconds>& bracket) {
  std::string list;
  for (const Nanoseconds exposure : bracket)
    list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", base::duration_text(exposure));
  return "bracket = [" + list + "]";
}

}  // namespace symrig::program

namespace symrig {

std::string_view name(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::warning:
      return "warning";
    case Severity::error:
      return "error";
  }
  return "error";
}

std::string FileFinding::text(std::string_view file) const {
  return fmt::format("{}:{}: {}: {}: {}{}{}", file, place, name(severity), rule, what,
                     alternative.empty() ? "" : "; ", alternative);
}

}  // namespace symrig

namespace symrig::program {

void fill_durations(CompiledProgram& compiled) {
  const auto config = board::line_setup(compiled.board, compiled.lines);
  if (!config) return;
  protocol::ProgramTiming timing;
  protocol::check_program({{compiled.program.bytes().data(), compiled.program.bytes().size()}},
                          board::program_rules(compiled.board, *config), timing,
                          [](const protocol::Violation&) { return false; });
  compiled.steps = timing.steps;
  compiled.shortest = compiled.board.rate.nanoseconds(Ticks{timing.min});
  compiled.longest = compiled.board.rate.nanoseconds(Ticks{timing.max});
  compiled.expected = compiled.shortest;
}

}  // namespace symrig::program

namespace symrig {
namespace {

void gather_lines(const std::vector<FileStep>& steps, std::set<std::string>& lines) {
  for (const FileStep& step : steps) {
    if (!step.line.empty()) lines.insert(step.line);
    gather_lines(step.steps, lines);
  }
}

/// The lines that a program changes or waits for. The receipt should contain their edges.
std::set<std::string> lines_in_use(const ProgramFile& file) {
  std::set<std::string> lines;
  gather_lines(file.steps, lines);
  for (const RigRole role :
       {RigRole::projector, RigRole::camera, RigRole::vsync, RigRole::strobe, RigRole::plane})
    if (const RigLine* line = file.rig.with_role(role)) lines.insert(line->config.line);
  if (file.scan && !file.scan->lamp.empty()) lines.insert(file.scan->lamp);
  return lines;
}

/// True if the board stamps the edges of a line to a microsecond. Coarser stamps come from interrupts: every
/// edge costs processor time, so such lines are captured only if the file demands it.
bool has_fine_stamps(const BoardInfo& board, std::string_view line) {
  const int k = board.line(line);
  if (k < 0) return false;
  const std::uint32_t ticks = board.lines[k].stamp_ticks;
  return ticks != 0 && board.rate.nanoseconds(Ticks{ticks}) <= Nanoseconds{1000};
}

/// The configuration for the board: the lines of the file, and default lines that the board has.
std::vector<LineConfig> line_configs(const ProgramFile& file, const BoardInfo& board) {
  std::vector<LineConfig> configs;
  const std::set<std::string> used = lines_in_use(file);
  for (const RigLine& line : file.rig.lines) {
    if (board.line(line.config.line) < 0) continue;
    configs.push_back(line.config);
    if (!line.capture_given)
      configs.back().capture = used.contains(line.config.line) && has_fine_stamps(board, line.config.line);
  }
  for (const std::string& name : used) {
    const bool there = std::any_of(configs.begin(), configs.end(),
                                   [&name](const LineConfig& config) { return config.line == name; });
    if (there || board.line(name) < 0) continue;
    configs.push_back({.line = name, .capture = has_fine_stamps(board, name)});
  }
  return configs;
}

/// Reports broken rules of the board, at the lines of the file.
void check_board(const CompiledProgram& compiled, int place, program::LintFindings& findings) {
  for (const Finding& finding : lint(compiled.program, compiled.board, compiled.lines)) {
    const bool placed = finding.record < compiled.places.size() && compiled.places[finding.record] != 0;
    findings.error(
        placed ? compiled.places[finding.record] : place, finding.rule,
        finding.line.empty() ? finding.what : fmt::format("line '{}': {}", finding.line, finding.what),
        finding.alternative);
  }
}

void fill_scan(const ProgramFile& file, CompiledProgram& compiled) {
  const Scan& scan = *file.scan;
  const program::ScanTiming timing(file.rig, scan);
  const std::uint64_t rounds = scan.order == ScanOrder::pattern_outer ? 1 : scan.bracket.size();
  compiled.is_scan = true;
  compiled.patterns = scan.pattern_count() * scan.repeat * rounds;
  for (const PatternGroup& group : scan.patterns)
    compiled.exposures += group.count * scan.repeat * scan.bracket_of(group).size();
  if (file.rig.projector.sync != PatternSync::trigger) return;
  Nanoseconds longest{0};
  for (const PatternGroup& group : scan.patterns) longest = std::max(longest, timing.on_time(group));
  compiled.on_time = longest;
}

/// Estimates the duration if waits end at the projector's refreshes. Uses the timeline of the first edges.
void estimate(const ProgramFile& file, CompiledProgram& compiled) {
  const Ticks period = compiled.board.rate.ticks(file.rig.projector.refresh);
  if (file.rig.projector.sync != PatternSync::vsync || period.count == 0) return;
  TimelineOptions options;
  options.max_edges = 200'000;
  options.edge_at = [period](const PlannedWait& wait) {
    return Ticks{(wait.begin.count + period.count - 1) / period.count * period.count};
  };
  const auto timeline = expand(compiled.program, compiled.board, options);
  if (!timeline || timeline->steps == 0) return;
  const double share = static_cast<double>(compiled.steps) / static_cast<double>(timeline->steps);
  const auto part = static_cast<double>(compiled.board.rate.nanoseconds(timeline->end).count());
  compiled.expected = Nanoseconds(static_cast<std::int64_t>(part * (timeline->complete ? 1 : share)));
}

/// The checks that need the records: the board's rules, and the camera's pulses in programs with steps.
void check_records(const ProgramFile& file, const CompiledProgram& compiled,
                   program::LintFindings& findings) {
  check_board(compiled, file.scan ? file.scan->place : 0, findings);
  if (file.scan || findings.fatal()) return;
  TimelineOptions twice;
  twice.max_rounds = 2;
  const auto timeline = expand(compiled.program, compiled.board, twice);
  if (timeline) program::check_camera_pulses(file, compiled.board, *timeline, compiled.places, findings);
}

CompiledProgram assemble(const ProgramFile& file, const BoardInfo& board, program::Emitted emitted) {
  CompiledProgram compiled;
  compiled.board = board;
  compiled.lines = line_configs(file, board);
  compiled.keep_alive = file.rig.keep_alive;
  compiled.program = std::move(emitted.program);
  compiled.places = std::move(emitted.places);
  compiled.wiring = wiring_of(file.rig);
  return compiled;
}

}  // namespace

Compilation compile_program(const ProgramFile& file, const BoardInfo& board) {
  program::LintFindings findings;
  program::check_lines(file, board, findings);
  program::check_times(file, board, findings);
  program::check_profiles(file, findings);
  if (file.scan) program::check_scan(file.rig, *file.scan, board, findings);
  Compilation out;
  std::optional<program::Emitted> emitted;
  if (!findings.fatal()) emitted = program::emit(program::lower(file, board), file.rig, board, findings);
  if (emitted) {
    CompiledProgram compiled = assemble(file, board, *std::move(emitted));
    check_records(file, compiled, findings);
    program::fill_durations(compiled);
    if (file.scan) fill_scan(file, compiled);
    estimate(file, compiled);
    if (!findings.fatal()) out.program = std::move(compiled);
  }
  out.findings = findings.take();
  return out;
}

}  // namespace symrig
