// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/run.hpp"

#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/program/compile.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kSlice = 100ms;   // between two calls of the progress callback
constexpr Nanoseconds kPatience = 10s;  // added to the longest duration of the program
constexpr Nanoseconds kAbortPatience = 2s;
constexpr int kBurst = 8;                          // readings without a pause, for a first bound
constexpr std::uint64_t kMostEvents = 10'000'000;  // of one run, all in memory: 240 MB
constexpr Nanoseconds kClockPeriod = 1s;           // between two readings of the board's clock

/// Reads the board's clock before, during and after a run.
class ClockWatch {
 public:
  explicit ClockWatch(TickRate rate) : model_(rate) {}

  Result<void> ask(Board& board) {
    SYMRIG_TRY(const TimeReading reading, board.time());
    ++note_.readings;
    asked_ = reading.received;
    if (const auto added = model_.add(reading); !added) note_.contradiction = added.error().what;
    return {};
  }
  /// The estimate at the last reading.
  ClockNote note() const {
    ClockNote note = note_;
    const auto there = model_.board_at(asked_);
    const auto drift = model_.drift_at(asked_);
    if (there) note.bound = model_.rate().nanoseconds(there->bound);
    if (drift) {
      note.drift_lowest = drift->lowest;
      note.drift_highest = drift->highest;
    }
    note.known = there.ok();
    return note;
  }

 private:
  ClockModel model_;
  HostTime asked_;
  ClockNote note_;
};

class Run {
 public:
  Run(Board& board, const CompiledProgram& program, const RunOptions& options)
      : board_(board), options_(options), clock_(board.info().rate) {
    record_.program = program;
  }

  Result<RunRecord> go() {
    SYMRIG_CHECK(check_board_fits(record_.program, board_.info()));
    SYMRIG_CHECK(check_length());
    record_.program.board = board_.info();
    SYMRIG_CHECK(leave_fault());
    SYMRIG_CHECK(board_.configure(record_.program.lines));
    SYMRIG_CHECK(board_.upload(record_.program.program));
    for (int k = 0; k < kBurst; ++k) SYMRIG_CHECK(clock_.ask(board_));
    progress_ = {0, record_.program.patterns, 0, Nanoseconds{0}, record_.program.expected};
    board_.on_mark([this](const StepMark& mark) { count(mark); });
    SYMRIG_CHECK(board_.arm());
    SYMRIG_CHECK(board_.start());
    if (const auto ended = wait(); !ended) take_what_arrived(ended.error());
    board_.on_mark({});
    SYMRIG_CHECK(look_back());
    return std::move(record_);
  }

 private:
  /// Each pattern and each exposure has a mark, each exposure two edges of the strobe, and a word at least
  /// one edge.
  Result<void> check_length() const {
    const CompiledProgram& program = record_.program;
    const bool captured = std::any_of(program.lines.begin(), program.lines.end(),
                                      [](const LineConfig& line) { return line.capture; });
    const std::uint64_t events = program.patterns + 3 * program.exposures + (captured ? program.steps : 0);
    if (events <= kMostEvents) return {};
    return Error{ErrorCode::limit,
                 fmt::format("the run would report {} marks and edges or more; a receipt holds at most {}",
                             events, kMostEvents),
                 "split the program, or set capture = false for its lines"};
  }

  /// Refuses the run if a fault of an earlier run is latched, unless the user asked to clear it.
  Result<void> leave_fault() {
    SYMRIG_TRY(const BoardStatus status, board_.status());
    if (status.state != BoardState::fault) return {};
    if (options_.clear_fault) return board_.clear_fault();
    const std::string fault = status.fault ? status.fault->name : std::string("unknown");
    return Error{ErrorCode::fault,
                 fmt::format("the board has latched the fault {} of an earlier run ({})", fault,
                             status.fault ? status.fault->hint : ""),
                 "when its cause is gone, clear it: symrig run --clear-fault"};
  }

  void count(const StepMark& mark) {
    ++progress_.marks;
    if (record_.program.is_scan && mark.id == kMarkPattern) ++progress_.patterns;
  }

  bool wanted() { return !options_.progress || options_.progress(progress_); }

  Result<void> wait() {
    const Nanoseconds most = record_.program.longest + kPatience;
    for (Nanoseconds waited{0}; waited < most; waited += kSlice) {
      if (!wanted()) return abort();
      auto receipt = board_.wait(kSlice);
      if (receipt) {
        record_.receipt = *std::move(receipt);
        return {};
      }
      if (receipt.error().code != ErrorCode::timeout) return receipt.error();
      progress_.elapsed = waited + kSlice;
      if (progress_.elapsed % kClockPeriod < kSlice) SYMRIG_CHECK(clock_.ask(board_));
    }
    SYMRIG_CHECK(board_.abort());
    SYMRIG_CHECK(board_.wait(kAbortPatience));
    return Error{ErrorCode::timeout,
                 fmt::format("the run has not ended {} after its longest planned duration",
                             base::duration_text(kPatience)),
                 "the run was aborted; check the link to the board"};
  }

  Result<void> abort() {
    record_.interrupted = true;
    SYMRIG_CHECK(board_.abort());
    SYMRIG_TRY(record_.receipt, board_.wait(kAbortPatience));
    return {};
  }

  /// The board does not answer, or does not end: the run is over at the last event that it reported.
  void take_what_arrived(const Error& error) {
    record_.lost = error;
    record_.receipt = board_.so_far();
    Receipt& receipt = record_.receipt;
    Ticks last = receipt.started;
    if (!receipt.marks.empty()) last = std::max(last, receipt.marks.back().tick);
    if (!receipt.edges.empty()) last = std::max(last, receipt.edges.back().tick);
    if (receipt.end == RunEnd::lost) receipt.actual = last - receipt.started;
  }

  /// Compares the plan with the captured edges, and pairs the frames.
  Result<void> look_back() {
    const CompiledProgram& program = record_.program;
    if (!record_.lost) SYMRIG_CHECK(clock_.ask(board_));
    record_.clock = clock_.note();
    SYMRIG_TRY(record_.plan, plan_of_run(program.program, program.board, program.lines, record_.receipt,
                                         options_.max_edges));
    if (record_.receipt.end != RunEnd::completed) cut_plan();
    record_.differences =
        compare(record_.plan, record_.receipt.edges, watched_outputs(program.board, program.lines));
    if (program.is_scan) SYMRIG_CHECK(pair_frames());
    return {};
  }

  /// Removes planned edges after the end of a run that ended early.
  void cut_plan() {
    const Ticks end = record_.receipt.started + record_.receipt.actual;
    std::erase_if(record_.plan.edges, [end](const PlannedEdge& edge) { return edge.tick > end; });
    record_.plan.end = std::min(record_.plan.end, end);
    record_.plan.complete = false;
  }

  Result<void> pair_frames() {
    const CompiledProgram& program = record_.program;
    const bool captured =
        !program.wiring.strobe.empty() &&
        std::any_of(program.lines.begin(), program.lines.end(), [&program](const LineConfig& line) {
          return line.capture && line.line == program.wiring.strobe;
        });
    if (!captured) return {};
    std::vector<StepMark> marks = record_.receipt.marks;
    std::erase_if(marks, [](const StepMark& mark) { return mark.id == kMarkStartup; });
    SYMRIG_TRY(record_.ledger, FrameLedger::pair(marks, frames(marks), tolerance(marks)));
    return {};
  }

  /// The starts of the exposures on the strobe line, without those before the first pattern.
  std::vector<FrameStamp> frames(const std::vector<StepMark>& marks) const {
    const CompiledProgram& program = record_.program;
    const int strobe = program.board.line(program.wiring.strobe);
    const bool active_low = program.wiring.is_active_low(program.wiring.strobe);
    std::vector<FrameStamp> out;
    for (const CapturedEdge& edge : record_.receipt.edges) {
      const bool begins = edge.line == strobe && edge.level != active_low;
      if (begins && !marks.empty() && edge.tick >= marks.front().tick) out.push_back({out.size(), edge.tick});
    }
    return out;
  }

  /// Half the shortest time between two exposures: a frame that is late by this still belongs to only one.
  static Ticks tolerance(const std::vector<StepMark>& marks) {
    std::uint64_t least = ~0ULL;
    for (std::size_t k = 1; k < marks.size(); ++k)
      if (marks[k - 1].id != kMarkPattern) least = std::min(least, (marks[k].tick - marks[k - 1].tick).count);
    return Ticks{marks.size() < 2 ? 0 : least / 2};
  }

  Board& board_;
  const RunOptions& options_;
  RunRecord record_;
  RunProgress progress_;
  ClockWatch clock_;
};

}  // namespace

Result<RunRecord> run_program(Board& board, const CompiledProgram& program, const RunOptions& options) {
  return Run(board, program, options).go();
}

namespace {

/// What a run that completed has lost.
std::optional<Error> loss(const RunRecord& record) {
  if (record.receipt.events_lost > 0)
    return Error{ErrorCode::frame_missing,
                 fmt::format("the board had no room for {} marks or captured edges, so what it measured is "
                             "not whole",
                             record.receipt.events_lost),
                 "capture fewer lines, or make the program slower"};
  if (record.ledger && !record.ledger->complete())
    return Error{ErrorCode::frame_missing, record.ledger->summary(),
                 "check the trigger and strobe cables, and that the camera's readout is no longer than the "
                 "program states"};
  return std::nullopt;
}

}  // namespace

std::optional<Error> run_error(const RunRecord& record) {
  const Receipt& receipt = record.receipt;
  if (record.lost) return record.lost;
  if (record.interrupted)
    return Error{ErrorCode::interrupted, "stopped; the board's outputs are at their safe levels",
                 "run it again"};
  switch (receipt.end) {
    case RunEnd::completed:
      return loss(record);
    case RunEnd::aborted:
      return Error{ErrorCode::interrupted, "the run was aborted; the outputs are at their safe levels"};
    case RunEnd::wait_timeout:
      return Error{ErrorCode::timeout,
                   fmt::format("an awaited edge did not come in time, {} after the start",
                               base::duration_text(receipt.duration())),
                   "check the wiring of the line that the program waits for"};
    case RunEnd::fault:
    case RunEnd::lost:
      break;
  }
  const std::string fault = receipt.fault ? receipt.fault->name : std::string("unknown");
  return Error{ErrorCode::fault,
               fmt::format("the board latched the fault {} {} after the start", fault,
                           base::duration_text(receipt.duration())),
               receipt.fault ? receipt.fault->hint : ""};
}

}  // namespace symrig
