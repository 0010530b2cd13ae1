// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "registers.hpp"

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

/// The edge engine's program for a PIO state machine, and the words that it reads.
/// docs/board-pico-debug.md explains it, with cycle counts.
namespace symrig::pico::edge_program {

// The PIO instructions that are used here.
constexpr uint16_t jmp(uint32_t to) {
  return static_cast<uint16_t>(to);
}
constexpr uint16_t jmp_y_dec(uint32_t to) {
  return static_cast<uint16_t>(0x0080U | to);
}
constexpr uint16_t wait_gpio(bool level, uint32_t pin) {
  return static_cast<uint16_t>(0x2000U | (level ? 0x80U : 0U) | pin);
}
constexpr uint16_t kOutPins27 = 0x601b;
constexpr uint16_t kOutPc5 = 0x60a5;
constexpr uint16_t kOutExec16 = 0x60f0;
constexpr uint16_t kOutPinDirections = 0x6080;
constexpr uint16_t kPull = 0x80a0;
constexpr uint16_t kPullOrX = 0x8080;  // takes X if the queue is empty
constexpr uint16_t kMovPinsX = 0xa001;
constexpr uint16_t kMovXOsr = 0xa027;
constexpr uint16_t kMovYOsr = 0xa047;
constexpr uint16_t irq_set(uint32_t flag) {
  return static_cast<uint16_t>(0xc000U | flag);
}

// Addresses.
constexpr uint32_t kWait = 0;
constexpr uint32_t kNext = 3;
constexpr uint32_t kDwell = 6;
constexpr uint32_t kEnd = 9;
constexpr uint32_t kHalt = 11;

// Flags that the program sets.
constexpr uint32_t kEndFlag = 0;
constexpr uint32_t kHaltFlag = 1;

constexpr uint16_t kCode[] = {
    // wait: the second word is two WAIT instructions
    kPull, kOutExec16, kOutExec16,
    // next: the first word, or the safe word (X) if there is none; its top five bits are the next address
    kPullOrX, kOutPins27, kOutPc5,
    // dwell: the second word is a count
    kPull, kMovYOsr, jmp_y_dec(8),
    // end: the last word stays
    irq_set(kEndFlag), jmp(10),
    // halt: the queue is empty, the safe word stays
    irq_set(kHaltFlag), jmp(12)};
constexpr uint32_t kCodeSize = sizeof kCode / sizeof kCode[0];
constexpr uint32_t kWrapTop = 8;
static_assert(kCode[kNext] == kPullOrX && kCode[kDwell + 2] == jmp_y_dec(kDwell + 2) &&
              kCode[kEnd + 1] == jmp(kEnd + 1) && kCode[kHalt + 1] == jmp(kHalt + 1));

constexpr uint32_t kLevelBits = 27;
/// First word of a segment.
constexpr uint32_t first_word(uint32_t levels, uint32_t then) {
  return levels | (then << kLevelBits);
}

/// Cycles of pull, out pins, out pc, pull, mov, and a loop that takes one cycle more than its count.
constexpr uint32_t kDwellOverhead = 6;
/// Second word of a segment that lasts `ticks`.
constexpr uint32_t dwell_word(uint32_t ticks) {
  return ticks - kDwellOverhead;
}
/// Second word of a wait: wait for the opposite level, then for the awaited one.
constexpr uint32_t wait_word(bool rising, uint32_t pin) {
  return wait_gpio(!rising, pin) | (static_cast<uint32_t>(wait_gpio(rising, pin)) << 16U);
}

}  // namespace symrig::pico::edge_program

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
