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

/// Where a run stands.
struct RunProgress {
  std::uint64_t patterns = 0;        ///< shown so far
  std::uint64_t patterns_asked = 0;  ///< in all; 0 for programs written by hand
  std::uint64_t marks = 0;           ///< passed so far
  Nanoseconds elapsed{0};            ///< on the link's clock since the start
  Nanoseconds expected{0};
};

struct RunOptions {
  /// Called several times a second while the run goes on, from the thread that called run_program().
  /// false: abort.
  std::function<bool(const RunProgress&)> progress;
  std::size_t max_edges = 1'000'000;  ///< planned edges kept for the comparison
  bool clear_fault = false;           ///< leave a fault that an earlier run has latched
};

/// How well the board's clock was known against the host's, by a ClockModel fed before, during and after the
/// run.
struct ClockNote {
  bool known = false;    ///< the readings agree with the limits of ClockLimits
  Nanoseconds bound{0};  ///< |board's clock as the host knows it - the truth| at most, at the end of the run
  double drift_lowest = 0, drift_highest = 0;  ///< rate of the board against the host's, minus 1
  std::uint32_t readings = 0;
  std::string contradiction;  ///< why a reading does not fit the others; empty if all do
};

/// A run with all that it left: what `symrig run -o` writes.
struct RunRecord {
  CompiledProgram program;  ///< its board is the one that ran it
  Receipt receipt;
  Timeline plan;  ///< with the waits as they ended
  Comparison differences;
  std::optional<FrameLedger> ledger;  ///< scans with a strobe line that is captured
  ClockNote clock;
  bool interrupted = false;  ///< aborted by the progress callback
};

/// Configures the lines, uploads the program, arms and starts it, keeps the board alive and waits for the
/// end. The board's keep-alive is its options' (BoardOptions), which should be program.keep_alive.
/// A run that ends by a time-out of a wait, a fault or an abort is no error here: the record says so.
/// fails: device_refused (another kind of board; what it refused), fault (latched by an earlier run),
/// device_lost, protocol, timeout (it did not end in time; it was aborted).
Result<RunRecord> run_program(Board& board, const CompiledProgram& program, const RunOptions& options = {});

/// The Error that a record stands for, if the run did not complete: fault, interrupted, timeout (a wait).
std::optional<Error> run_error(const RunRecord& record);

/// docs/receipt.md. At most max_edges planned and as many captured edges are listed; with more, the counts
/// and the statistics of each line stand for the rest.
std::string receipt_json(const RunRecord& record, std::size_t max_edges = 100'000);

/// What a receipt file tells of its edges.
struct StoredRun {
  BoardInfo board;
  Timeline plan;  ///< edges, start, end and initial levels only
  std::vector<CapturedEdge> captured;
  std::uint32_t watched = 0;  ///< outputs whose edges were captured
  bool whole = true;          ///< all edges are listed
};
/// fails: bad_format.
Result<StoredRun> read_receipt(std::string_view text);

}  // namespace symrig
