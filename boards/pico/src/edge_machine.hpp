// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "edge_program.hpp"
#include "registers.hpp"

/// The state machine that plays the edges: machine 0 of PIO0.
namespace symrig::pico::edge_machine {

constexpr uint32_t kEndFlag = 1U << edge_program::kEndFlag;
constexpr uint32_t kHaltFlag = 1U << edge_program::kHaltFlag;
constexpr uint32_t kStalled = 1U << 24U;   ///< FDEBUG: it waited for the second word of a segment
constexpr uint32_t kOverflow = 1U << 16U;  ///< FDEBUG: a word was written to a full queue
constexpr uint32_t kEnable = 1;
constexpr uint32_t kRestart = 1U << 4U;
constexpr uint32_t kQueueDepth = 8;

/// kEnable, kRestart or 0 (stops).
inline void control(uint32_t bits) {
  reg(pio::pio0 + pio::ctrl) = bits;
}
inline void execute(uint16_t instruction) {
  reg(pio::pio0 + pio::instr) = instruction;
}
/// Gives a word to a stopped machine through its queue, which is empty.
inline void pull_in(uint32_t word) {
  reg(pio::pio0 + pio::txf0) = word;
  execute(edge_program::kPull);
}

/// Writes the count that ends the launch: count - (cycles since SysTick had the value `reference`). The
/// instructions are fixed, so the time between reading SysTick and writing is constant (part of
/// kLaunchLatency).
void write_count_down(uint32_t reference, uint32_t count);
/// Enables the machine. Returns the SysTick value a fixed number of cycles earlier (part of kEnableLatency).
uint32_t enable_timed();

}  // namespace symrig::pico::edge_machine
