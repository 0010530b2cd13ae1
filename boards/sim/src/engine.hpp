// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/playback.hpp"
#include "symrig/hal/capture.hpp"
#include "symrig/hal/clock.hpp"

#include <cstddef>
#include <cstdint>

namespace symrig::board_sim {

/// The edge engine in virtual time: exact. An empty queue is an underrun, as in the real one.
class Engine final : public hal::EdgeEngine {
 public:
  /// depth: segments. wait_latency: ticks from an awaited edge, or from its time-out, to the next word.
  Engine(board_common::WordSink& sink, const hal::Clock& clock, const hal::Capture& pins, std::size_t depth,
         std::uint32_t wait_latency)
      : clock_(clock),
        pins_(pins),
        playback_(sink, {.lateness = 0, .wait_latency = wait_latency, .input = 0}, depth) {}

  std::size_t room() const override { return playback_.room(); }
  void push(const hal::Segment& segment) override { playback_.push(segment); }
  void close() override { playback_.close(); }
  hal::Tick start(hal::Tick tick) override { return playback_.start(tick, clock_.now()); }
  bool idle() const override { return playback_.idle(); }
  std::uint32_t levels() const override { return playback_.levels(); }
  bool underrun() const override { return playback_.underrun(); }
  std::uint64_t played() const override { return playback_.played(); }
  bool pop_wait(hal::WaitOutcome& outcome) override { return playback_.pop_wait(outcome); }
  void force(std::uint32_t levels) override { playback_.force(levels); }
  void set_safe(std::uint32_t levels) override { playback_.set_safe(levels); }
  void set_trips(std::uint32_t lines, std::uint32_t levels) override {
    playback_.set_trips(lines, levels, pins_.levels());
  }
  std::uint32_t tripped() const override { return playback_.tripped(); }

  /// When the next segment, an underrun or a time-out is due.
  hal::Tick next_event() const { return playback_.due(); }
  /// Does what is due; next_event() must be now.
  void step() { playback_.act(clock_.now()); }
  /// An input line changed at the present tick.
  void input_changed(std::uint8_t line, bool level) {
    playback_.input({clock_.now(), line, level});
    playback_.inputs_are(pins_.levels());  // a trip line that is still at its trip level trips again
  }

 private:
  const hal::Clock& clock_;
  const hal::Capture& pins_;
  board_common::Playback playback_;
};

}  // namespace symrig::board_sim
