// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"
#include "symrig/program/program_file.hpp"

#include <cstddef>
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
  std::vector<int> places;     ///< line of the file for each record
  RigWiring wiring;            ///< its strobe line shows the camera's exposures
  bool is_scan = false;        ///< marks follow compile_brackets, so that frames can be paired with exposures
  std::uint64_t patterns = 0;  ///< total number shown; 0 for programs with steps
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

/// Mark ids of compiled brackets: 0 when a pattern is asked for, 1 + j when exposure j begins.
inline constexpr std::uint32_t kMarkPattern = 0;
constexpr std::uint32_t mark_of_exposure(std::size_t j) {
  return static_cast<std::uint32_t>(1 + j);
}

/// The scan of one batch of photographs, as a capture asks for it: brackets[i] holds the exposures of
/// photograph i, and equal neighbours share a group. The scan asks only the lines that a rig has
/// (Scan::lines_as_wired). gap: from the end of an exposure to the next trigger; none: the camera's shortest.
Scan scan_of_brackets(std::span<const std::vector<Nanoseconds>> brackets,
                      std::optional<Nanoseconds> gap = {});

/// Compiles that scan for a board with compile_program().
/// fails: bad_argument (no photographs, an empty bracket, or the first error that the linter finds: what it
/// found, with the nearest legal value as the hint), unknown_name (the board has no such line).
Result<CompiledProgram> compile_brackets(const RigSetup& rig, const BoardInfo& board,
                                         std::span<const std::vector<Nanoseconds>> brackets,
                                         std::optional<Nanoseconds> gap = {});

/// How long before its plane an exposure waits for the plane's edge.
constexpr Nanoseconds plane_lead(Nanoseconds period) {
  return period / 4;
}

/// Compiles exposures in bit planes (rig.projector.sync = plane). The program waits for
/// the vsync line once. Then it waits for the edge of each exposure's plane, a quarter of a plane before it
/// is due, so that an edge of another plane cannot be taken for it. If the edge does not come, the program
/// goes on: the receipt then lacks the edge. Exposure i has the marks of photograph i with one exposure.
/// fails: as compile_brackets().
Result<CompiledProgram> compile_planes(const RigSetup& rig, const BoardInfo& board,
                                       std::span<const PlaneExposure> exposures,
                                       std::optional<Nanoseconds> gap = {});

/// A compiled program as a file (scan.symprog): its board, the configuration of its lines, and its records.
/// docs/program-file.md gives the bytes.
std::vector<std::uint8_t> symprog_bytes(const CompiledProgram& program);

/// fails: bad_format (not such a file, damaged, of a newer version).
Result<CompiledProgram> read_symprog(std::span<const std::uint8_t> bytes);

/// True if the bytes begin like a compiled program.
bool looks_like_symprog(std::span<const std::uint8_t> bytes);

/// Checks that a board has the lines, tick rate and limits for which the program was compiled.
/// fails: device_refused (the message names the first difference).
Result<void> check_board_fits(const CompiledProgram& program, const BoardInfo& board);

/// Hash of the configuration as the board computes it (PROTOCOL.md). fails: as Board::configure().
Result<std::uint32_t> config_hash(const CompiledProgram& program);

}  // namespace symrig
