// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board_info.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
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

}  // namespace symrig
