// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"
#include "symrig/program/program_file.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

enum class Severity : std::uint8_t { note, warning, error };
std::string_view name(Severity severity);

/// Something about a program file that its author should know.
struct FileFinding {
  Severity severity = Severity::error;
  int place = 0;            ///< line of the file
  std::string rule;         ///< docs/lint-rules.md explains each
  std::string what;         ///< with its numbers
  std::string alternative;  ///< the shortest legal alternative, ready to be pasted where it is a setting

  /// "scan.toml:12: error: camera.min_exposure: exposure of 5 us: ...; bracket = [...]"
  std::string text(std::string_view file) const;
};

/// A rule that the linter knows.
struct LintRule {
  std::string_view name;
  std::string_view about;  ///< one line
};
/// All rules: those of program files first, then the board's own.
std::span<const LintRule> lint_rules();

/// Mark id of start-up exposures (Scan::startup). They are no photographs.
inline constexpr std::uint32_t kMarkStartup = (1U << 28U) - 1;

/// A program file made ready for one kind of board.
struct CompiledProgram {
  BoardInfo board;
  std::vector<LineConfig> lines;
  Nanoseconds keep_alive{0};
  Program program;
  std::vector<int> places;      ///< line of the file for each record
  RigWiring wiring;             ///< its strobe line shows the camera's exposures
  bool is_scan = false;         ///< marks follow bracket.hpp, so that frames can be paired with exposures
  std::uint64_t patterns = 0;   ///< shown in all; 0 for programs written by hand
  std::uint64_t exposures = 0;  ///< in all, start-up exposures not counted
  std::uint64_t steps = 0;      ///< words put out
  Nanoseconds shortest{0};      ///< if every awaited edge comes at once
  Nanoseconds longest{0};       ///< if every wait runs out
  Nanoseconds expected{0};      ///< with the projector's refresh, if it is known; else as shortest
  std::optional<Nanoseconds> on_time;  ///< how long a triggered projector has to show each pattern, at least
};

struct Compilation {
  std::vector<FileFinding> findings;       ///< by line of the file
  std::optional<CompiledProgram> program;  ///< if no finding is an error

  bool ok() const { return program.has_value(); }
};

/// Turns a program file into records, and lints it: devices, lines and the board's own rules. Every time is
/// rounded to the nearest tick (readouts and gaps up): an edge is off by at most half a tick for each
/// duration since the last wait. Work is bounded by the length of the file, not by the rounds of its loops.
Compilation compile_program(const ProgramFile& file, const BoardInfo& board);

}  // namespace symrig
