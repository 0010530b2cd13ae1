// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/program/timeline.hpp"
#include "symrig/run/compare.hpp"
#include "symrig/run/frame_ledger.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// The progress of a run.
struct RunProgress {
  std::uint64_t patterns = 0;        ///< shown so far
  std::uint64_t patterns_asked = 0;  ///< total of the program; 0 for programs with steps
  std::uint64_t marks = 0;           ///< reported so far
  Nanoseconds elapsed{0};            ///< on the link's clock since the start
  Nanoseconds expected{0};
};

struct RunOptions {
  /// Called several times a second during the run, from the thread that called run_program(). Returns false
  /// to abort the run.
  std::function<bool(const RunProgress&)> progress;
  std::size_t max_edges = 1'000'000;  ///< largest number of planned edges for the comparison
  bool clear_fault = false;           ///< clear the latched fault of an earlier run
};

/// How well the host knew the board's clock: a ClockModel of readings before, during and after the run.
struct ClockNote {
  bool known = false;                          ///< all readings fit the limits of ClockLimits
  Nanoseconds bound{0};                        ///< largest error of the model at the end of the run
  double drift_lowest = 0, drift_highest = 0;  ///< rate of the board against the host's, minus 1
  std::uint32_t readings = 0;
  std::string contradiction;  ///< why a reading does not fit the others; empty if all fit
};

/// A run with all its results: the content of the receipt that `symrig run -o` writes.
struct RunRecord {
  CompiledProgram program;  ///< its board is the one that ran it
  Receipt receipt;
  Timeline plan;  ///< with the actual ends of the waits
  Comparison differences;
  std::optional<FrameLedger> ledger;  ///< only for scans with a captured strobe line
  ClockNote clock;
  bool interrupted = false;  ///< aborted by the progress callback
  std::optional<Error>
      lost;  ///< why the host has not learnt how the run ended; the receipt is what arrived before
};

/// Configures the lines, uploads, arms and starts the program, sends keep-alives and waits for the end. The
/// keep-alive is that of BoardOptions; it should be program.keep_alive.
/// A run that has started is never an error here, however it ended: the record contains it (run_error()).
/// fails before the start: device_refused (another kind of board, or a refused request), fault (latched by an
/// earlier run), limit (more than 10 million marks and edges), device_lost, protocol, timeout.
Result<RunRecord> run_program(Board& board, const CompiledProgram& program, const RunOptions& options = {});

/// The Error of a run that did not complete: fault, interrupted, timeout (of a wait, or the run did not end
/// in time, and was aborted), device_lost, protocol. Of a run that completed: frame_missing, if the board
/// lost marks or edges, or the camera has not taken exactly the asked frames.
std::optional<Error> run_error(const RunRecord& record);

/// The receipt as JSON (docs/receipt.md). It lists at most max_edges planned edges and max_edges captured
/// edges. The counts and the statistics of each line include all edges.
std::string receipt_json(const RunRecord& record, std::size_t max_edges = 100'000);

/// The edges of a receipt file.
struct StoredRun {
  BoardInfo board;
  Timeline plan;  ///< edges, start, end and initial levels only
  std::vector<CapturedEdge> captured;
  std::uint32_t watched = 0;  ///< outputs whose edges were captured
  bool whole = true;          ///< the file lists all edges
};
/// fails: bad_format.
Result<StoredRun> read_receipt(std::string_view text);

}  // namespace symrig
