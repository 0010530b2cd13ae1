// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board_info.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

enum class EdgeKind : std::uint8_t { rising = 0, falling = 1, both = 2 };
enum class OnTimeout : std::uint8_t { keep_going = 0, abort = 1 };

/// The timed steps that a board runs: packed 8-byte records, in the format of the wire
/// (protocol/PROTOCOL.md).
class Program {
 public:
  std::span<const std::uint8_t> bytes() const { return bytes_; }
  std::size_t records() const { return bytes_.size() / 8; }
  /// CRC-32C of bytes(). Commits and receipts identify a program by it.
  std::uint32_t hash() const;

  /// A program from stored bytes. fails: bad_format (length not a multiple of 8). Use lint() to check the
  /// content.
  static Result<Program> from_bytes(std::vector<std::uint8_t> bytes);

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Writes a program step by step. Calls can be chained; end() returns the first error.
///
/// set() changes lines for the next hold(); each hold() sets all outputs at once. At the end of a loop body
/// every line must have the level of its start, because the first hold is the same in every round.
class ProgramBuilder {
 public:
  /// All outputs low at the beginning.
  explicit ProgramBuilder(BoardInfo board);

  ProgramBuilder& set(std::string_view line, bool level);
  /// Sets the outputs and holds them, at least for min_dwell. A hold longer than max_dwell needs several
  /// records.
  ProgramBuilder& hold(Nanoseconds duration);
  ProgramBuilder& hold(Ticks duration);
  /// set(line, true), hold(width), set(line, false).
  ProgramBuilder& pulse(std::string_view line, Nanoseconds width);
  /// Runs the steps up to end_loop() `rounds` times (1 to 2^32).
  ProgramBuilder& loop(std::uint64_t rounds);
  ProgramBuilder& end_loop();
  /// Holds the lines until the first edge after the beginning of the wait. If lines were set without a hold,
  /// they are held for min_dwell first.
  ProgramBuilder& wait_edge(std::string_view line, EdgeKind edge, Nanoseconds timeout, OnTimeout action);
  /// The board reports the tick at which the next step begins, with this id (< 2^28).
  ProgramBuilder& mark(std::uint32_t id);
  /// Records written so far.
  std::size_t records() const { return bytes_.size() / 8; }
  /// Ends the program with the lines as last set. fails: unknown_name, bad_argument, limit (too long).
  Result<Program> end();
  /// Lines were set and nothing holds them yet: before a loop, its end, a wait or the end of the program, the
  /// builder holds them for the board's shortest time.
  bool pending() const { return pending_; }

 private:
  void fail(ErrorCode code, std::string what, std::string hint);
  int output(std::string_view line);
  void put(std::uint32_t word, std::uint32_t ticks);
  void flush();

  struct Loop {
    std::uint32_t levels;
  };

  BoardInfo board_;
  std::vector<std::uint8_t> bytes_;
  std::uint32_t levels_ = 0;
  bool pending_ = false;
  std::vector<Loop> loops_;
  Result<void> state_;
};

/// One broken rule. The rules are those of the board: if lint() finds nothing, the board accepts the commit.
struct Finding {
  std::string rule;         ///< "min_dwell", "max_on", "loop_depth", ...: as in protocol/PROTOCOL.md
  std::size_t record = 0;   ///< index of the record in the program
  std::string line;         ///< the line's name, empty if the rule concerns none
  std::string what;         ///< the problem with its numbers
  std::string alternative;  ///< the nearest legal choice

  /// "record 5: line 'lamp_enable' max_on: on for 2.000 s, limit 1.000 s; turn it off after at most 1.000 s"
  std::string line_of_text() const;
};

/// Checks a program against a board and the configuration of its lines. The cost grows with the length of the
/// program, not with its duration. Empty if no rule is broken.
std::vector<Finding> lint(const Program& program, const BoardInfo& board, std::span<const LineConfig> lines);

/// A mark that the board reported.
struct StepMark {
  std::uint32_t id = 0;
  std::uint32_t ordinal = 0;  ///< number of marks before it in this run
  Ticks tick;                 ///< on the board's clock

  bool operator==(const StepMark&) const = default;
};

/// An edge that the board captured on one of its lines.
struct CapturedEdge {
  int line = 0;
  bool level = false;
  Ticks tick;

  bool operator==(const CapturedEdge&) const = default;
};

/// How a run ended. Values are those of the wire; `lost` is not on it: the host has not learnt how the run
/// ended.
enum class RunEnd : std::uint8_t { completed = 0, aborted = 1, wait_timeout = 2, fault = 3, lost = 255 };
std::string_view name(RunEnd end);

/// A latched fault.
struct FaultInfo {
  std::uint32_t code = 0;  ///< FaultCode of the wire
  Ticks tick;
  std::uint64_t arg = 0;  ///< the line for limits, the record for waits, 0 for others
  std::string name;       ///< "max_on"
  std::string hint;       ///< what it means and what to do
};

/// What a run planned and what the board measured.
struct Receipt {
  std::uint32_t program_hash = 0;
  std::uint32_t config_hash = 0;
  std::uint64_t firmware_hash = 0;
  TickRate rate;

  Ticks started;            ///< first word out, on the board's clock
  Ticks planned_min;        ///< duration if every awaited edge comes at once
  Ticks planned_max;        ///< duration if every wait times out
  Ticks actual;             ///< duration measured by the board
  std::uint64_t steps = 0;  ///< words that went out

  std::vector<StepMark> marks;
  std::vector<CapturedEdge> edges;  ///< of lines configured with capture

  std::uint32_t underruns = 0;    ///< the edge engine ran dry
  std::uint32_t late = 0;         ///< words that began later than planned
  std::uint32_t events_lost = 0;  ///< marks or edges lost because the board's memory for events was full
  RunEnd end = RunEnd::completed;
  std::optional<FaultInfo> fault;

  Nanoseconds duration() const { return rate.nanoseconds(actual); }
  /// True if the run completed without faults and without loss.
  bool clean() const {
    return end == RunEnd::completed && underruns == 0 && late == 0 && events_lost == 0 && !fault;
  }
};

}  // namespace symrig
