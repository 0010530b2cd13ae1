// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/playback.hpp"
#include "symrig/hal/clock.hpp"
#include "symrig/hal/edge_engine.hpp"

#include <cstddef>
#include <cstdint>

namespace symrig::board_sim {

/// The edge engine in virtual time: exact. An empty queue is an underrun, as in the real one.
class Engine final : public board_common::PlaybackEngine<> {
 public:
  /// depth: segments. wait_latency: ticks from an awaited edge, or from its time-out, to the next word.
  Engine(board_common::WordSink& sink, const hal::Clock& clock, const hal::Capture& pins, std::size_t depth,
         std::uint32_t wait_latency)
      : PlaybackEngine(sink, {.lateness = 0, .wait_latency = wait_latency, .input = 0}, depth),
        clock_(clock),
        pins_(pins) {}

  /// When the next segment, an underrun or a time-out is due.
  hal::Tick next_event() const { return playback_.due(); }
  /// Does what is due; next_event() must be now.
  void step() { playback_.act(now()); }
  /// An input line changed at the present tick.
  void input_changed(std::uint8_t line, bool level) {
    playback_.input({now(), line, level});
    playback_.inputs_are(inputs());  // a trip line that is still at its trip level trips again
  }

 private:
  hal::Tick now() const override { return clock_.now(); }
  std::uint32_t inputs() override { return pins_.levels(); }

  const hal::Clock& clock_;
  const hal::Capture& pins_;
};

}  // namespace symrig::board_sim
