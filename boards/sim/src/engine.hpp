// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/edge_engine.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

namespace symrig::boards {

/// Where the engine's words go and what it sees.
class Pins {
 public:
  virtual void drive(std::uint32_t levels) = 0;
  virtual std::uint32_t levels() const = 0;
  virtual std::uint64_t now() const = 0;

 protected:
  ~Pins() = default;
};

/// The edge engine in virtual time: exact, and as unforgiving about an empty queue as the real one.
class Engine final : public hal::EdgeEngine {
 public:
  /// depth: segments. wait_latency: ticks from an awaited edge, or its time-out, to the next word.
  Engine(Pins& pins, std::size_t depth, std::uint32_t wait_latency)
      : pins_(pins), wait_latency_(wait_latency), queue_(depth) {}

  std::size_t room() const override { return queue_.size() - count_; }
  void push(const hal::Segment& segment) override;
  void close() override { closed_ = true; }
  hal::Tick start(hal::Tick tick) override;
  bool idle() const override { return !playing_; }
  std::uint32_t levels() const override { return levels_; }
  bool underrun() const override { return underrun_; }
  std::uint64_t played() const override { return played_; }
  bool pop_wait(hal::WaitOutcome& outcome) override;
  void force(std::uint32_t levels) override;
  void set_safe(std::uint32_t levels) override { safe_ = levels; }
  void set_trips(std::uint32_t lines, std::uint32_t levels) override;
  std::uint32_t tripped() const override { return tripped_; }

  /// When the next segment is due (or the queue is found empty, or a wait runs out).
  hal::Tick next_event() const { return playing_ ? next_ : hal::kNever; }
  /// Does what is due at next_event() == now.
  void step();
  /// An input line changed, now.
  void input_changed(std::uint8_t line, bool level);

 private:
  struct LastEdge {
    hal::Tick tick = hal::kNever;
    bool level = false;
  };

  void drive(std::uint32_t levels);
  void stop();
  void stop_safe();
  void begin_wait(const hal::Segment& wait);
  void end_wait(hal::Tick tick, bool timed_out);
  bool ends_wait(std::uint8_t line, bool level) const;
  void check_trips();

  Pins& pins_;
  std::uint32_t wait_latency_;
  std::vector<hal::Segment> queue_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  bool playing_ = false;
  bool closed_ = false;
  bool underrun_ = false;
  bool waiting_ = false;
  hal::Segment wait_;
  std::deque<hal::WaitOutcome> waits_;
  std::array<LastEdge, 32> last_edges_{};
  std::uint64_t played_ = 0;
  std::uint32_t levels_ = 0;
  std::uint32_t safe_ = 0;
  std::uint32_t trip_lines_ = 0;
  std::uint32_t trip_levels_ = 0;
  std::uint32_t tripped_ = 0;
  hal::Tick next_ = 0;
};

}  // namespace symrig::boards
