// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board_info.hpp"
#include "symrig/program/program_file.hpp"

#include <cstdint>
#include <vector>

namespace symrig::program {

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

}  // namespace symrig::program
