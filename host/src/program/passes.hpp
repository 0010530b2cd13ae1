// SPDX-License-Identifier: Apache-2.0
// The passes of compile(): checks, moves, words and records, durations.
#pragma once

#include "symrig/board/board_info.hpp"
#include "symrig/board/program.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/program/timeline.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace symrig::program {

/// Collects findings. The rule names come from the table in lint_rules.cpp.
class LintFindings {
 public:
  void error(int place, std::string_view rule, std::string what, std::string alternative) {
    add(Severity::error, place, rule, std::move(what), std::move(alternative));
  }
  void warning(int place, std::string_view rule, std::string what, std::string alternative) {
    add(Severity::warning, place, rule, std::move(what), std::move(alternative));
  }
  void note(int place, std::string_view rule, std::string what, std::string alternative) {
    add(Severity::note, place, rule, std::move(what), std::move(alternative));
  }
  void add(Severity severity, int place, std::string_view rule, std::string what, std::string alternative) {
    all_.push_back({severity, place, std::string(rule), std::move(what), std::move(alternative)});
  }
  bool fatal() const;
  /// The findings, sorted by line of the file, without duplicates.
  std::vector<FileFinding> take();

 private:
  std::vector<FileFinding> all_;
};

/// `key = "1 ms"`
std::string setting(std::string_view key, Nanoseconds value);
/// `bracket = ["1 ms", "2 ms"]`
std::string bracket_setting(const std::vector<Nanoseconds>& bracket);

/// What a program file comes down to: moves of lines in ticks, waits, marks and loops. Levels are those of
/// the pins; delays are not in yet.
struct Move {
  enum class Kind : std::uint8_t { set, hold, wait, mark, loop, end_loop };

  Kind kind = Kind::hold;
  int line = 0;          ///< set, wait
  bool level = false;    ///< set
  bool at_once = false;  ///< set: without the delay of the line, for levels that stand already
  Ticks ticks = {};      ///< hold, wait (time-out)
  EdgeKind edge = EdgeKind::rising;
  OnTimeout on_timeout = OnTimeout::abort;
  std::uint64_t count = 0;  ///< loop (rounds), mark (id)
  int place = 0;            ///< line of the file
};

/// Writes moves, by the names of lines. Names must be known to the board.
class MoveList {
 public:
  MoveList(const BoardInfo& board, const RigSetup& rig) : board_(&board), rig_(&rig) {}

  /// To the line's active level, or back.
  void set(std::string_view line, bool on, int place);
  /// The line is off already: says so to what counts levels.
  void is_off(std::string_view line, int place);
  void hold(Ticks ticks, int place);
  void hold(Nanoseconds time, int place) { hold(board_->rate.ticks(time), place); }
  /// At least that long.
  void hold_up(Nanoseconds time, int place) { hold(ticks_up(time), place); }
  void pulse(std::string_view line, Ticks width, int place);
  void wait(std::string_view line, EdgeKind edge, Nanoseconds timeout, OnTimeout action, int place);
  void mark(std::uint64_t id, int place);
  void loop(std::uint64_t rounds, int place);
  void end_loop(int place);

  Ticks ticks_up(Nanoseconds time) const;
  const std::vector<Move>& moves() const { return moves_; }

 private:
  const BoardInfo* board_;
  const RigSetup* rig_;
  std::vector<Move> moves_;
};

/// Reports unknown lines, missing roles, wrong directions, and lamps without a keep-alive.
void check_lines(const ProgramFile& file, const BoardInfo& board, LintFindings& findings);

/// Reports numbers of the device profiles that have no source.
void check_profiles(const ProgramFile& file, LintFindings& findings);

/// Checks the durations and time-outs of a program with steps, and a scan's time-out, against the board.
void check_times(const ProgramFile& file, const BoardInfo& board, LintFindings& findings);

/// Checks the pulses on the camera's line of a program with steps against the camera. timeline: with at most
/// two rounds of every loop, which shows every pair of neighbouring pulses.
void check_camera_pulses(const ProgramFile& file, const BoardInfo& board, const Timeline& timeline,
                         const std::vector<int>& places, LintFindings& findings);

/// Checks a scan against the limits of its camera, its projector and its lamp.
void check_scan(const RigSetup& rig, const Scan& scan, const BoardInfo& board, LintFindings& findings);

/// Checks a scan against the bit planes of its projector.
void check_planes(const RigSetup& rig, const Scan& scan, LintFindings& findings);

/// The moves of a program file that the checks have passed.
MoveList lower(const ProgramFile& file, const BoardInfo& board);

struct Emitted {
  Program program;
  std::vector<int> places;  ///< line of the file for each record
};

/// Applies each line's delay, merges the lines' timelines into words, and writes the records. If a word
/// cannot be written, adds a finding and returns none.
///
/// Between waits and loop ends each line has its own timeline, shifted by its delay: an edge of time t goes
/// out at t + delay. Sorting merges the timelines, so delayed lines may overlap freely. But all edges of a
/// stretch must be out at its end, because the next step may begin at any time, or repeat.
std::optional<Emitted> emit(const MoveList& moves, const RigSetup& rig, const BoardInfo& board,
                            LintFindings& findings);

/// Computes steps, shortest and longest time from the records alone. Sets `expected` to the shortest.
void fill_durations(CompiledProgram& compiled);

}  // namespace symrig::program
