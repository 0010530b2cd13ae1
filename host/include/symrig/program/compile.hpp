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

/// A finding of the linter about a program file.
struct FileFinding {
  Severity severity = Severity::error;
  int place = 0;            ///< line of the file
  std::string rule;         ///< lint_rules() explains each
  std::string what;         ///< the problem with its numbers
  std::string alternative;  ///< the shortest legal alternative; if it is a setting, it can be pasted

  /// "scan.toml:12: error: camera.min_exposure: exposure of 5 us: ...; bracket = [...]"
  std::string text(std::string_view file) const;
};

/// A rule that the linter knows, and an example file that breaks or keeps it. The board's own rules have no
/// example: protocol/PROTOCOL.md explains them.
struct LintRule {
  std::string_view name;
  std::string_view about;               ///< one line
  Severity severity = Severity::error;  ///< of the example's finding; other cases may be graver
  std::string_view explanation = {};    ///< sentences, in lines
  std::string_view before = {}, breaks = {}, keeps = {}, after = {};  ///< parts of the example

  /// `part` is `breaks` or `keeps`.
  std::string example(std::string_view part) const {
    return "symrig = 1\n" + std::string(before) + std::string(part) + std::string(after);
  }
};
/// All rules: those of program files first, then the board's own.
std::span<const LintRule> lint_rules();

/// Mark id of start-up exposures (Scan::startup). They are not part of a photograph.
inline constexpr std::uint32_t kMarkStartup = (1U << 28U) - 1;

/// A program file, compiled for one kind of board.
struct CompiledProgram {
  BoardInfo board;
  std::vector<LineConfig> lines;
  Nanoseconds keep_alive{0};
  Program program;
  std::vector<int> places;      ///< line of the file for each record
  RigWiring wiring;             ///< its strobe line shows the camera's exposures
  bool is_scan = false;         ///< marks follow bracket.hpp, so that frames can be paired with exposures
  std::uint64_t patterns = 0;   ///< total number shown; 0 for programs with steps
  std::uint64_t exposures = 0;  ///< total number, without start-up exposures
  std::uint64_t steps = 0;      ///< words that go out
  Nanoseconds shortest{0};      ///< duration if every awaited edge comes at once
  Nanoseconds longest{0};       ///< duration if every wait times out
  Nanoseconds expected{0};      ///< duration with the projector's refresh; without a refresh the shortest
  std::optional<Nanoseconds> on_time;  ///< shortest time that a triggered projector must show each pattern
};

struct Compilation {
  std::vector<FileFinding> findings;       ///< sorted by line of the file
  std::optional<CompiledProgram> program;  ///< present if no finding is an error

  bool ok() const { return program.has_value(); }
};

/// Compiles a program file into records and lints it: devices, lines and the board's own rules. Every time is
/// rounded to the nearest tick (readouts and gaps up). The error of an edge is at most half a tick for each
/// duration since the last wait. The cost grows with the length of the file, not with the rounds of its
/// loops.
Compilation compile_program(const ProgramFile& file, const BoardInfo& board);

}  // namespace symrig
