// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clock.hpp"
#include "gpio.hpp"
#include "process.hpp"
#include "symrig/boards/pin_log.hpp"
#include "symrig/boards/playback.hpp"
#include "symrig/hal/edge_engine.hpp"
#include "symrig/hal/peripherals.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace symrig::board_linux {

struct PlayerOptions {
  board_common::Promise promise;
  std::size_t depth = 4096;          ///< segments
  std::size_t captured = 4096;       ///< capacity for edges until the firmware takes them
  std::uint32_t output_mask = 0;     ///< the lines that are outputs
  hal::Tick spin = 0;                ///< how long before a word the player wakes to watch the clock
  hal::Tick patience = 400'000'000;  ///< after this time without feed(), the outputs go to their safe levels
  int priority = 0;                  ///< of SCHED_FIFO; 0 = do not request it
};

/// Plays words on a Gpio in its own thread: absolute sleeps, then watching the clock for the last
/// microseconds. Only that thread reads edges, ends waits and handles trips. It also goes to the safe word if
/// the queue is empty or the main loop stops feeding it. All this works without the main loop.
///
/// One other thread, the main loop's, may call it. Of these calls, only force() and start() drive outputs.
class Player final : private board_common::WordSink,
                     public board_common::PlaybackEngine<PriorityMutex>,
                     public hal::Watchdog {
 public:
  Player(Gpio& gpio, const PlayerOptions& options);
  ~Player();
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  /// Starts the thread. Does not change the outputs. Returns why the thread may be late, for the log; empty
  /// if there is no reason.
  std::string begin();

  // hal::EdgeEngine, where the thread must know of it
  void push(const hal::Segment& segment) override;
  hal::Tick start(hal::Tick tick) override;

  // hal::Watchdog
  void feed() override;
  /// The main loop will be busy for `time`, with outputs at their safe levels, and need not feed.
  void excuse(hal::Tick time);
  /// true: feed() came too late, so the outputs were made safe. The caller must restart the firmware. Clears
  /// the flag.
  bool take_starved();

  /// Readable when the main loop has work.
  int attention_fd() const { return attention_.fd(); }
  void quiet_attention() const { attention_.quiet(); }
  /// errno of a line that could not be set or read; 0 = none. This cannot be recovered.
  int broken() const { return broken_; }
  /// When the thread last finished a round.
  hal::Tick last_round() const { return round_; }

 private:
  friend class PinCapture;

  hal::Tick put(std::uint32_t levels) override;
  hal::Tick put_all(std::uint32_t levels) override;
  hal::Tick drive(std::uint32_t levels, std::uint32_t lines);
  void run();
  void sleep_until(hal::Tick tick);
  void lose_chip(int fd);
  void read_edges();
  void take_edges(std::size_t count, bool lost);
  void play_on();
  void await_due() const;
  void watch_feeding();
  hal::Tick now() const override;
  std::uint32_t inputs() override;

  Gpio& gpio_;
  PlayerOptions options_;
  board_common::PinLog log_;  // guarded by mutex_
  std::uint32_t shown_ = 0;
  bool half_told_ = false;
  std::vector<hal::CapturedEdge> edges_;  // used only by the thread
  std::vector<int> edge_fds_;
  Alarm alarm_;
  Bell nudge_;      // to the thread: something changed
  Bell attention_;  // from the thread
  std::atomic<hal::Tick> fed_;
  std::atomic<hal::Tick> round_;
  std::atomic<bool> starved_ = false;
  std::atomic<bool> stopping_ = false;
  std::atomic<int> broken_ = 0;
  std::thread thread_;
};

/// Gives the player's edges to the firmware.
class PinCapture final : public hal::Capture {
 public:
  explicit PinCapture(Player& player) : player_(player) {}

  std::uint32_t levels() const override;
  bool pop(hal::CapturedEdge& edge) override;
  bool take_overflow() override;
  void watch(std::uint32_t lines) override;
  /// The time from which pop() returns an edge; kNever if there is none.
  hal::Tick ready_at() const;

 private:
  Player& player_;
};

}  // namespace symrig::board_linux
