// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/clock.hpp"
#include "symrig/hal/edge_engine.hpp"
#include "symrig/hal/peripherals.hpp"

namespace symrig::hal {

/// Edges of a line that the engine can wait for. Bits of Line::waits.
namespace waits {
constexpr uint8_t rising = 1;
constexpr uint8_t falling = 2;
constexpr uint8_t both = 4;
constexpr uint8_t all = 7;
}  // namespace waits

/// A line of the board, as its maker wired and named it. The texts live as long as the board.
struct Line {
  const char* name = "";
  const char* pin = "";  ///< its name on the silk screen or in the data sheet ("GPIO16")
  bool output = false;
  uint8_t waits = 0;         ///< inputs: edges that programs can wait for
  bool trips = false;        ///< inputs: may be an interlock
  uint32_t stamp_ticks = 0;  ///< resolution of its time-stamps; 0 = the board stamps no edges here
};

/// The identity and the abilities of a board. Everything lives as long as the board.
struct BoardTraits {
  const char* name = "";
  const uint8_t* unique_id = nullptr;
  uint8_t unique_id_size = 0;  ///< at most 16
  const Line* lines = nullptr;
  uint8_t line_count = 0;  ///< at most 32; outputs among the first 28
  uint64_t tick_hz = 0;
  uint32_t min_dwell = 1;  ///< shortest word of the edge engine, ticks
  uint32_t max_dwell = UINT32_MAX;
  uint32_t wait_latency = 0;  ///< ticks from an awaited edge to the first word after it
  // The cost of keeping the engine's queue filled; refill_ticks = 0: no cost (virtual time).
  uint32_t queue_segments = 2;  ///< depth of the engine's queue
  uint32_t refill_ticks = 0;    ///< largest time to expand and push one record of a program
  uint32_t poll_ticks = 0;      ///< largest time between the refills of two polls during a run
  // For a best-effort board, whose edges are made by software: the largest lateness of a word that is not
  // counted.
  uint32_t lateness = 0;  ///< 0 = edges are made by hardware, exact to the tick
};

/// The hardware that the firmware core needs.
struct Board {
  const BoardTraits& traits;
  Clock& clock;
  EdgeEngine& engine;
  Capture& capture;
  ByteLink& link;
  FaultStore& faults;
  Watchdog& watchdog;
  Indicator& indicator;
  Settings& settings;
  System& system;
};

}  // namespace symrig::hal
