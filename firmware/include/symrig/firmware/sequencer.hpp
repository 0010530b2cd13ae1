// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/edge_engine.hpp"
#include "symrig/protocol/program.hpp"

namespace symrig::firmware {

/// A mark whose tick has come.
struct PassedMark {
  uint32_t id = 0;
  uint32_t ordinal = 0;
  hal::Tick tick = 0;
};

/// The totals of a run.
struct RunTally {
  hal::Tick started = 0;
  hal::Tick ended = 0;
  uint64_t steps = 0;  ///< words that went out, without that of End
  uint32_t underruns = 0;
  uint32_t late = 0;  ///< a start whose tick had passed, and words later than the board's lateness
};

/// A mark that is not due yet: `offset` ticks after the start of its stretch.
struct QueuedMark {
  uint32_t id = 0;
  uint32_t stretch = 0;
  uint64_t offset = 0;
};

/// Room for marks between their expansion and their tick, supplied by the board. It needs at least as many
/// places as the engine's queue. Otherwise marks would prevent the refill of the queue
/// (protocol/program_timing.hpp).
struct MarkRoom {
  QueuedMark* slots = nullptr;
  uint32_t count = 0;
};

/// Expands a program's loops into segments for the edge engine and keeps its queue filled.
///
/// A run is a chain of stretches. A stretch begins at the start or at the end of a wait, and ends at the next
/// wait or at the end. The engine makes all edges and waits. It reports when each stretch began, and this
/// gives the ticks of the marks.
class Sequencer {
 public:
  enum class Outcome : uint8_t { idle, running, complete, wait_timeout, underrun };

  Sequencer(hal::EdgeEngine& engine, MarkRoom marks) : engine_(engine), marks_(marks) {}

  /// Begins to run a committed program at tick `at`. If `at` has passed, begins at once and counts as late;
  /// 0: at once. The engine must be idle.
  void begin(protocol::ProgramView program, uint32_t min_dwell, hal::Tick at);
  /// Continues the run as far as possible. The caller must have taken all due marks before.
  Outcome poll(hal::Tick now);
  /// Takes the oldest mark that is due.
  bool take_mark(hal::Tick now, PassedMark& passed);
  /// Ends the run, because the engine will be forced to other levels. Completes the tally.
  void stop(hal::Tick now);

  bool running() const { return phase_ != Phase::idle; }
  /// The record of the last wait.
  uint32_t waited_at() const { return waited_at_; }
  const RunTally& tally() const { return tally_; }
  /// The number of records expanded since the last call; a wait counts as many as the queue can hold for one
  /// (protocol/program_timing.hpp).
  uint32_t take_expanded() {
    const uint32_t count = expanded_;
    expanded_ = 0;
    return count;
  }
  uint64_t steps() const { return running() ? engine_.played() : tally_.steps; }
  /// The first tick at which poll() or take_mark() has work, apart from the refill of the engine.
  hal::Tick next_deadline() const;

 private:
  enum class Phase : uint8_t { idle, filling, closing };
  struct Loop {
    uint32_t body = 0;
    uint64_t left = 0;
  };
  struct Wait {
    uint32_t record = 0;
    bool abort = false;
  };

  void fill();
  void push(const hal::Segment& segment);
  bool expand(const protocol::Record& record);
  bool add_word(const protocol::Record& record);
  bool add_wait(const protocol::Record& record);
  bool add_mark(uint32_t id);
  bool finish(uint32_t levels);
  void turn_round();
  /// Reads from the engine when stretches began. true: a wait that timed out has ended the run.
  bool take_waits();
  hal::Tick& base(uint32_t stretch) { return bases_[stretch % kBases]; }
  hal::Tick base(uint32_t stretch) const { return bases_[stretch % kBases]; }
  uint32_t slot(uint32_t index) const;
  const QueuedMark& mark(uint32_t index) const { return marks_.slots[slot(index)]; }
  bool known(const QueuedMark& mark) const { return mark.stretch <= known_; }
  Outcome conclude(Outcome outcome, hal::Tick tick);

  // Marks of an older stretch are taken before the waits, and at most kMaxWaits stretches are queued after
  // the one that plays.
  static constexpr uint32_t kBases = 2 * hal::kMaxWaits;
  static_assert(hal::kMaxWaits <= protocol::kMaxWaitsQueued);

  hal::EdgeEngine& engine_;
  MarkRoom marks_;
  protocol::ProgramView program_;
  uint32_t min_dwell_ = 1;
  Phase phase_ = Phase::idle;
  uint32_t pc_ = 0;
  size_t room_ = 0;       // segments that the engine accepts before the next call of room()
  uint32_t levels_ = 0;   // levels of the last pushed word
  uint32_t stretch_ = 0;  // number of the stretch in expansion
  uint64_t offset_ = 0;   // length of the expanded part of this stretch
  uint32_t known_ = 0;    // last stretch with a known begin
  hal::Tick bases_[kBases] = {};
  Wait waits_[hal::kMaxWaits];
  uint32_t waited_at_ = 0;
  hal::Tick polled_ = 0;  // when poll() was last called
  Loop loops_[protocol::kMaxLoopDepth];
  uint32_t depth_ = 0;

  uint32_t mark_first_ = 0;
  uint32_t mark_count_ = 0;
  uint32_t ordinal_ = 0;
  uint32_t expanded_ = 0;
  RunTally tally_;
};

}  // namespace symrig::firmware
