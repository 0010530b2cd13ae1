// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/pin_log.hpp"
#include "symrig/hal/edge_engine.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>

namespace symrig::board_common {

/// The outputs that words are written to.
class WordSink {
 public:
  /// Sets the outputs to the word. Returns the tick at which it was there.
  virtual hal::Tick put(std::uint32_t levels) = 0;
  /// The same, but writes every line, because a line may not have the level that was set.
  virtual hal::Tick put_all(std::uint32_t levels) = 0;

 protected:
  ~WordSink() = default;
};

/// The timing that an engine can keep, in ticks. For a board in virtual time, no word is late and `input` is
/// 0.
struct Promise {
  std::uint32_t min_dwell = 1;
  std::uint32_t lateness = 1;      ///< greatest lateness of a word
  std::uint32_t wait_latency = 2;  ///< from an awaited edge to the next word; must exceed `input`
  std::uint32_t input = 1;         ///< from an edge until it is known here
};

/// The rules of the edge engine (hal/edge_engine.hpp) for boards whose edges software makes. It has no clock
/// and no threads. Its owner passes the time, calls act() when something is due, and reports input edges.
/// Deterministic. The sink may call input() and inputs_are() while it writes a word.
class Playback {
 public:
  Playback(WordSink& sink, const Promise& promise, std::size_t depth)
      : sink_(sink), promise_(promise), queue_(depth), outcomes_(hal::kMaxWaits) {}

  std::size_t room() const { return queue_.room(); }
  std::size_t queued() const { return queue_.size(); }
  void push(const hal::Segment& segment);
  void close() { closed_ = true; }
  hal::Tick start(hal::Tick tick, hal::Tick now);
  bool idle() const { return !playing_; }
  bool waiting() const { return waiting_; }
  std::uint32_t levels() const { return levels_; }
  bool underrun() const { return underrun_; }
  std::uint64_t played() const { return played_; }
  std::uint32_t late() const { return late_; }
  bool pop_wait(hal::WaitOutcome& outcome) { return outcomes_.pop(outcome); }
  /// After a trip, force() sets the safe word and start() plays nothing, until set_trips() leaves out the
  /// line. The trip may come while the firmware decides to move the outputs.
  void force(std::uint32_t levels);
  void set_safe(std::uint32_t levels) { safe_ = levels; }
  std::uint32_t safe() const { return safe_; }
  /// Keeps the trips of lines that stay watched. inputs: their present levels.
  void set_trips(std::uint32_t lines, std::uint32_t levels, std::uint32_t inputs);
  std::uint32_t tripped() const { return tripped_; }

  /// When act() is due next; kNever while idle.
  hal::Tick due() const;
  /// Does what is due at `now`: the next word, the end of a wait, or the end of the run. Does nothing if it
  /// is too early.
  void act(hal::Tick now);
  /// An input changed. Edges of one line must come in order of time.
  void input(const hal::CapturedEdge& edge);
  /// The inputs were read again, because edges may have been lost.
  void inputs_are(std::uint32_t levels);
  /// The firmware no longer fills the queue: goes to the safe word, as after an underrun.
  void fall();

 private:
  void play(const hal::Segment& segment, hal::Tick now);
  void begin_wait(const hal::Segment& wait);
  void end_wait(hal::Tick tick, bool timed_out);
  bool ends_wait(const hal::CapturedEdge& edge) const;
  void run_dry();
  void stop();
  hal::Tick stop_safe();
  void check_trips(std::uint32_t at_level);

  static constexpr std::size_t kRecent = 64;

  WordSink& sink_;
  Promise promise_;
  Ring<hal::Segment> queue_;
  Ring<hal::WaitOutcome> outcomes_;
  bool playing_ = false;
  bool closed_ = false;
  bool underrun_ = false;
  bool waiting_ = false;
  hal::Segment wait_;
  hal::Tick wait_begin_ = 0;
  hal::Tick next_ = 0;  // planned tick of the next word; in a wait: its time-out
  std::uint64_t played_ = 0;
  std::uint32_t late_ = 0;
  std::uint32_t levels_ = 0;
  std::uint32_t safe_ = 0;
  std::uint32_t trip_lines_ = 0;
  std::uint32_t trip_levels_ = 0;
  std::uint32_t tripped_ = 0;
  // Recent edges. A wait that begins late may have had its edge already.
  std::array<hal::CapturedEdge, kRecent> recent_{};
  std::size_t recent_count_ = 0;
};

/// The lock of a board whose engine has one thread: there is nothing to lock.
struct NoMutex {
  void lock() {}
  void unlock() {}
};

/// The edge engine of a board whose edges software makes: a Playback, called under a lock.
/// A board adds what is its own: the time, the levels of its inputs, and the caller of act().
/// Mutex: has lock() and unlock(). Each call holds it, so now() and inputs() run with it held.
template <class Mutex = NoMutex>
class PlaybackEngine : public hal::EdgeEngine {
 public:
  PlaybackEngine(WordSink& sink, const Promise& promise, std::size_t depth)
      : playback_(sink, promise, depth) {}

  std::size_t room() const override {
    return locked([&] { return playback_.room(); });
  }
  void push(const hal::Segment& segment) override {
    locked([&] { playback_.push(segment); });
  }
  void close() override {
    locked([&] { playback_.close(); });
  }
  hal::Tick start(hal::Tick tick) override {
    return locked([&] { return playback_.start(tick, now()); });
  }
  bool idle() const override {
    return locked([&] { return playback_.idle(); });
  }
  std::uint32_t levels() const override {
    return locked([&] { return playback_.levels(); });
  }
  bool underrun() const override {
    return locked([&] { return playback_.underrun(); });
  }
  std::uint64_t played() const override {
    return locked([&] { return playback_.played(); });
  }
  std::uint32_t late() const override {
    return locked([&] { return playback_.late(); });
  }
  bool pop_wait(hal::WaitOutcome& outcome) override {
    return locked([&] { return playback_.pop_wait(outcome); });
  }
  void force(std::uint32_t levels) override {
    locked([&] { playback_.force(levels); });
  }
  void set_safe(std::uint32_t levels) override {
    locked([&] { playback_.set_safe(levels); });
  }
  void set_trips(std::uint32_t lines, std::uint32_t levels) override {
    locked([&] { playback_.set_trips(lines, levels, lines == 0 ? 0 : inputs()); });
  }
  std::uint32_t tripped() const override {
    return locked([&] { return playback_.tripped(); });
  }

 protected:
  ~PlaybackEngine() = default;

  /// The board's time.
  virtual hal::Tick now() const = 0;
  /// The present levels of the inputs.
  virtual std::uint32_t inputs() = 0;

  /// Calls `act` with the lock held.
  template <class Act>
  auto locked(Act&& act) const {
    const std::scoped_lock lock(mutex_);
    return act();
  }

  mutable Mutex mutex_;
  Playback playback_;  // guarded by mutex_
};

}  // namespace symrig::board_common
