// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/capture.hpp"
#include "symrig/hal/edge_engine.hpp"
#include "symrig/protocol/program.hpp"

namespace symrig::firmware {

/// A mark whose tick has come.
struct PassedMark {
  uint32_t id = 0;
  uint32_t ordinal = 0;
  hal::Tick tick = 0;
};

/// What a run amounted to.
struct RunTally {
  hal::Tick started = 0;
  hal::Tick ended = 0;
  uint64_t steps = 0;  ///< words put out, End's not counted
  uint32_t underruns = 0;
  uint32_t late = 0;
};

/// Expands a program's loops into segments for the edge engine and keeps its queue filled.
///
/// A run is a chain of stretches: from the start or from the end of a wait to the next wait or the end.
/// Within a stretch every edge is the engine's; between stretches the last word stands.
class Sequencer {
 public:
  enum class Outcome : uint8_t { idle, running, complete, wait_timeout, underrun };

  explicit Sequencer(hal::EdgeEngine& engine) : engine_(engine) {}

  /// Begins to run a committed program at `at` (now, if that is past). The engine is idle.
  void begin(protocol::ProgramView program, uint32_t min_dwell, uint32_t wait_latency, hal::Tick at,
             hal::Tick now);
  /// Tells of an edge on any line; edges come in order of time, before poll() for the same tick.
  void edge(const hal::CapturedEdge& edge);
  /// Goes on with the run as far as it can. Marks that are due must have been taken before.
  Outcome poll(hal::Tick now);
  /// Takes the oldest mark that is due.
  bool take_mark(hal::Tick now, PassedMark& mark);
  /// Forgets the run (the engine has been forced to other levels); the tally is completed.
  void stop(hal::Tick now);

  bool running() const { return phase_ != Phase::idle; }
  /// Record that waits or waited last.
  uint32_t record() const { return pc_; }
  const RunTally& tally() const { return tally_; }
  uint64_t steps() const { return tally_.steps + (running() ? engine_.played() : 0); }
  /// First tick at which poll() or take_mark() has something to do, but for edges and the engine's needs.
  hal::Tick next_deadline() const;

 private:
  enum class Phase : uint8_t { idle, filling, before_wait, waiting, before_end };
  struct Loop {
    uint32_t body = 0;
    uint32_t left = 0;
  };
  struct Mark {
    uint32_t id = 0;
    uint64_t offset = 0;
  };

  void begin_stretch(hal::Tick at);
  void fill();
  bool expand(const protocol::Record& record);
  bool add_word(const protocol::Record& record);
  bool add_mark(uint32_t id);
  bool finish(uint32_t levels);
  void end_stretch(Phase phase);
  void turn_round();
  void await();
  Outcome wait(hal::Tick now);
  void resume(hal::Tick at);
  hal::Tick barrier() const { return base_ + offset_; }
  Outcome conclude(Outcome outcome, hal::Tick tick);

  static constexpr uint32_t kMarks = 32;

  hal::EdgeEngine& engine_;
  protocol::ProgramView program_;
  uint32_t min_dwell_ = 1;
  uint32_t wait_latency_ = 0;
  Phase phase_ = Phase::idle;
  uint32_t pc_ = 0;
  hal::Tick base_ = 0;   // when this stretch begins
  uint64_t offset_ = 0;  // length of this stretch as far as it is expanded
  uint32_t pushed_ = 0;  // segments in this stretch
  bool engine_on_ = false;
  uint32_t final_word_ = 0;  // 1 if End's word was pushed, which is no step
  Loop loops_[protocol::kMaxLoopDepth];
  uint32_t depth_ = 0;

  protocol::WaitEdge awaited_;
  uint64_t timeout_ = 0;
  bool edge_seen_ = false;
  hal::Tick edge_tick_ = 0;

  Mark marks_[kMarks];
  uint32_t mark_first_ = 0;
  uint32_t mark_count_ = 0;
  uint32_t ordinal_ = 0;
  RunTally tally_;
};

}  // namespace symrig::firmware
