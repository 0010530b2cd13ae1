// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/byte_link.hpp"
#include "symrig/hal/capture.hpp"
#include "symrig/hal/clock.hpp"
#include "symrig/hal/edge_engine.hpp"
#include "symrig/hal/fault_store.hpp"

namespace symrig::hal {

/// A line as the board's maker wired and named it. `name` lives as long as the board.
struct Line {
  const char* name = "";
  bool output = false;
};

/// What a board is and can do. Everything lives as long as the board.
struct BoardTraits {
  const char* name = "";
  const uint8_t* unique_id = nullptr;
  uint8_t unique_id_size = 0;  ///< at most 16
  const Line* lines = nullptr;
  uint8_t line_count = 0;  ///< at most 32; outputs among the first 28
  uint64_t tick_hz = 0;
  uint32_t min_dwell = 1;  ///< shortest word the edge engine can play, ticks
  uint32_t max_dwell = UINT32_MAX;
  uint32_t wait_latency = 0;  ///< ticks from a captured edge to the first word after it, at most
};

/// All that the firmware core needs to run.
struct Board {
  const BoardTraits& traits;
  Clock& clock;
  EdgeEngine& engine;
  Capture& capture;
  ByteLink& link;
  FaultStore& faults;
};

}  // namespace symrig::hal
