// SPDX-License-Identifier: Apache-2.0
#include "program/passes.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <string>

#include <fmt/format.h>

namespace symrig::program {
namespace {

constexpr Nanoseconds kLongestKeepAlive{60'000'000'000};    // ttl_ms of the wire: at most 60,000
constexpr Nanoseconds kLongestLaserKeepAlive{500'000'000};  // the board's limit

class LineCheck {
 public:
  LineCheck(const ProgramFile& file, const BoardInfo& board, LintFindings& findings)
      : file_(file), board_(board), findings_(findings) {}

  void run() {
    for (const RigLine& line : file_.rig.lines)
      if (line.place != 0) check_named(line);
    if (file_.scan) check_scan(*file_.scan);
    check_steps(file_.steps);
    check_hazards();
    check_lights();
  }

 private:
  /// Index of a line that the file uses, or -1. Reports an unknown line or a wrong direction.
  int look_up(std::string_view line, bool output, int place) {
    const int k = board_.line(line);
    if (k < 0) {
      findings_.error(place, "line.unknown", fmt::format("board '{}' has no line '{}'", board_.board, line),
                      fmt::format("outputs: {}; inputs: {}", board::known_lines(board_, true),
                                  board::known_lines(board_, false)));
      return -1;
    }
    if (board_.lines[k].output == output) return k;
    findings_.error(place, "line.direction",
                    fmt::format("line '{}' is an {}, but the program needs an {} here", line,
                                output ? "input" : "output", output ? "output" : "input"),
                    fmt::format("{}: {}", output ? "outputs" : "inputs", board::known_lines(board_, output)));
    return -1;
  }

  void check_named(const RigLine& line) {
    const bool input = line.role == RigRole::vsync || line.role == RigRole::strobe ||
                       line.role == RigRole::interlock || line.role == RigRole::plane;
    const bool output =
        line.role == RigRole::projector || line.role == RigRole::camera || line.role == RigRole::lamp;
    const int k = board_.line(line.config.line);
    const bool either = !input && !output;
    const bool is_output = k >= 0 && board_.lines[k].output;
    look_up(line.config.line, either ? is_output : output, line.place);
    check_interlock(line, k);
    if (!is_output && k >= 0 && line.delay.count() != 0)
      findings_.error(
          line.place, "line.direction",
          fmt::format("line '{}' is an input, and only outputs can have a delay", line.config.line),
          "delay = \"0 ns\"");
  }

  void check_interlock(const RigLine& line, int k) {
    if (line.role != RigRole::interlock || k < 0 || board_.lines[k].trips) return;
    std::string able;
    for (const LineInfo& one : board_.lines)
      if (one.trips) able += (able.empty() ? "" : ", ") + one.name;
    findings_.error(line.place, "interlock",
                    fmt::format("board '{}' cannot stop on line '{}'", board_.board, line.config.line),
                    able.empty() ? "none of its lines can" : "lines that can: " + able);
  }

  void need(RigRole role, bool output, int place) {
    const RigLine* line = file_.rig.with_role(role);
    if (line == nullptr) {
      findings_.error(place, "line.role", fmt::format("no line has the role \"{}\"", name(role)),
                      fmt::format("[rig.lines.NAME] with role = \"{}\"; {}: {}", name(role),
                                  output ? "outputs" : "inputs", board::known_lines(board_, output)));
    } else {
      look_up(line->config.line, output, line->place != 0 ? line->place : place);
    }
  }

  /// Bit planes follow each other by themselves: no line asks for them.
  void need_projector(int place) {
    const PatternSync sync = file_.rig.projector.sync;
    if (sync != PatternSync::plane) need(RigRole::projector, true, place);
    if (sync != PatternSync::trigger) need(RigRole::vsync, false, place);
    if (sync == PatternSync::plane) need(RigRole::plane, false, place);
  }

  void check_scan(const Scan& scan) {
    if (!scan.lines_as_wired) need_projector(scan.place);
    if (scan.lines_as_wired) look_up_wired();
    if (!scan.plane_exposures.empty()) {
      need(RigRole::vsync, false, scan.place);
      need(RigRole::plane, false, scan.place);
    }
    need(RigRole::camera, true, scan.place);
    if (!scan.lamp.empty()) look_up(scan.lamp, true, scan.lamp_place);
    if (scan.start_marker) look_up(scan.start_marker->line, true, scan.start_marker->place);
  }

  /// The lines that a capture asks, as far as the rig has them.
  void look_up_wired() {
    const RigLine* projector = file_.rig.with_role(RigRole::projector);
    const RigLine* vsync = file_.rig.with_role(RigRole::vsync);
    if (projector != nullptr) look_up(projector->config.line, true, projector->place);
    if (vsync != nullptr) look_up(vsync->config.line, false, vsync->place);
  }

  void check_steps(const std::vector<FileStep>& steps) {
    for (const FileStep& step : steps) {
      check_step(step);
      check_steps(step.steps);
    }
  }

  void check_step(const FileStep& step) {
    if (step.kind == FileStep::Kind::set || step.kind == FileStep::Kind::pulse)
      look_up(step.line, true, step.place);
    if (step.kind == FileStep::Kind::wait) look_up(step.line, false, step.place);
    if (step.kind == FileStep::Kind::pattern) need_projector(step.place);
    if (step.kind == FileStep::Kind::expose) need(RigRole::camera, true, step.place);
  }

  /// Lines that the program switches, and where.
  using Switched = std::map<std::string, int>;
  static void add_switched(const std::vector<FileStep>& steps, Switched& lines) {
    for (const FileStep& step : steps) {
      if (step.kind == FileStep::Kind::set || step.kind == FileStep::Kind::pulse)
        lines.emplace(step.line, step.place);
      add_switched(step.steps, lines);
    }
  }

  static bool names_a_light(std::string_view line) {
    std::string lower(line);
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return lower.find("lamp") != std::string::npos || lower.find("laser") != std::string::npos;
  }

  /// A lamp or laser that the file says nothing of: by its use as the scan's lamp, or by its name.
  void check_lights() {
    Switched lines;
    add_switched(file_.steps, lines);
    std::erase_if(lines, [](const auto& line) { return !names_a_light(line.first); });
    if (file_.scan && !file_.scan->lamp.empty()) lines.emplace(file_.scan->lamp, file_.scan->lamp_place);
    for (const auto& [name, place] : lines) {
      const RigLine* line = file_.rig.find(name);
      const bool stated = line != nullptr && (line->config.hazard != Hazard::benign || line->hazard_given ||
                                              line->config.max_on.count() != 0);
      if (stated) continue;
      findings_.warning(
          place, "lamp.unlimited",
          fmt::format("line '{}' switches a lamp or laser, by its name or its use, and has no "
                      "limit on its time on",
                      name),
          fmt::format(R"([rig.lines.{}] with role = "lamp" and max_on; or hazard = "benign")", name));
    }
  }

  void check_hazards() {
    const RigSetup& rig = file_.rig;
    for (const RigLine& line : rig.lines) {
      if (line.config.hazard == Hazard::benign) continue;
      const bool laser = line.config.hazard == Hazard::laser;
      if (rig.keep_alive.count() == 0)
        findings_.error(rig.place, "keep_alive.needed",
                        fmt::format("line '{}' is a lamp or laser: the board must make it safe if the host "
                                    "sends nothing",
                                    line.config.line),
                        laser ? "keep_alive = \"500 ms\"" : "keep_alive = \"1 s\"");
      if (laser && rig.keep_alive > kLongestLaserKeepAlive)
        findings_.error(rig.place, "keep_alive.needed",
                        fmt::format("a keep-alive of {} is too long for the laser on line '{}'",
                                    base::duration_text(rig.keep_alive), line.config.line),
                        "keep_alive = \"500 ms\"");
      if (line.config.max_on.count() == 0)
        findings_.add(
            laser ? Severity::error : Severity::warning, line.place, "lamp.unlimited",
            fmt::format("line '{}' is a lamp or laser without a limit on its time on", line.config.line),
            "max_on = the longest time without danger");
    }
    if (rig.keep_alive > kLongestKeepAlive)
      findings_.error(rig.place, "keep_alive.needed",
                      fmt::format("a keep-alive of {} is too long", base::duration_text(rig.keep_alive)),
                      "keep_alive = \"60 s\"");
  }

  const ProgramFile& file_;
  const BoardInfo& board_;
  LintFindings& findings_;
};

void note_assumptions(std::string_view table, std::string_view profile, const std::vector<std::string>& keys,
                      int place, LintFindings& findings) {
  if (keys.empty()) return;
  std::string all;
  for (const std::string& key : keys) all += (all.empty() ? "" : ", ") + key;
  findings.note(place, "profile.assumption", fmt::format("profile '{}': no source for {}", profile, all),
                fmt::format("measure it and set it in [rig.{}]", table));
}

}  // namespace

void check_lines(const ProgramFile& file, const BoardInfo& board, LintFindings& findings) {
  LineCheck(file, board, findings).run();
}

void check_profiles(const ProgramFile& file, LintFindings& findings) {
  const RigSetup& rig = file.rig;
  if (file.scan || has_step(file.steps, FileStep::Kind::expose))
    note_assumptions("camera", rig.camera.name, rig.camera.assumptions, rig.camera_place, findings);
  if (file.scan || has_step(file.steps, FileStep::Kind::pattern))
    note_assumptions("projector", rig.projector.name, rig.projector.assumptions, rig.projector_place,
                     findings);
}

}  // namespace symrig::program
