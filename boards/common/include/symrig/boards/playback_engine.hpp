// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/playback.hpp"

#include <cstddef>
#include <mutex>

namespace symrig::board_common {

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
