// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

/// The registers of a processor at a crash, in the form that survives a reset.
struct Crash {
  uint32_t exception = 0;  ///< its number; 0 = no crash is kept
  uint32_t pc = 0;
  uint32_t lr = 0;
  uint32_t psr = 0;    ///< its lower six bits: the number of the interrupted exception, 0 = the main program
  uint32_t sp = 0;     ///< before the exception
  uint32_t r[5] = {};  ///< r0 to r3, r12
};

/// What a board has measured about itself since it started. The core measures its rounds and refills itself.
struct Diagnostics {
  uint32_t flash_reads = 0;      ///< accesses to flash since all code runs from RAM; modulo 2^32
  uint32_t flash_hits = 0;       ///< those of them that the cache answered
  uint32_t queue_overflows = 0;  ///< words written to a full hardware queue
  uint32_t dma_errors = 0;
  uint32_t stack_free = 0;     ///< bytes of the stack that were never used
  uint32_t chip_revision = 0;  ///< 0 = not known
  Crash crash;                 ///< before the last reset
};

/// Refills of fewer records are not compared with refill_ticks: they say more about the interrupts that came
/// in them than about their records.
constexpr uint32_t kRefillSample = 256;

}  // namespace symrig::hal
