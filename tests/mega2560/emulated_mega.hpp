// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/link.hpp"

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

namespace symrig::test {

/// A pin of the Arduino Mega changed.
struct MegaEdge {
  std::uint64_t cycle = 0;  ///< of 16 MHz
  unsigned line = 0;        ///< number on the wire
  bool level = false;
};

/// The image that users flash, on simavr's ATmega2560, in virtual time. Its UART is paced like 115,200 baud.
class EmulatedMega {
 public:
  static constexpr std::uint64_t kHz = 16'000'000;

  /// Why the image cannot be run on this machine; empty if it can.
  static std::string missing();

  /// The board has started, and something drives each of its inputs low.
  EmulatedMega();
  EmulatedMega(const EmulatedMega&) = delete;
  EmulatedMega& operator=(const EmulatedMega&) = delete;
  ~EmulatedMega();

  /// A link over the UART. Waiting on it runs the board. One at a time; the board must outlive it.
  std::unique_ptr<Link> link();

  /// Runs for so many cycles.
  void run(std::uint64_t cycles);
  std::uint64_t cycle() const;
  /// Sets an input (line 6 to 11).
  void set_input(unsigned line, bool level);
  /// Sets it when the board has reached this cycle. Calls in order of time.
  void set_input_at(std::uint64_t cycle, unsigned line, bool level);
  /// From now on this input changes every `cycles` (0: no more), beginning with the opposite of its level.
  void chatter(unsigned line, std::uint64_t cycles);
  /// A wire from an output to an input.
  void jumper(unsigned output, unsigned input);
  /// The processor stays where it is, with interrupts off, as after a fault of the firmware. Timers go on.
  void stop_firmware();
  /// The board's clock goes ahead by this many steps of 2^23 ticks (4.2 s). Its second clock notices nothing:
  /// it wraps after that time.
  void skip_time(std::uint32_t steps);
  static constexpr std::uint64_t kStep = std::uint64_t{1} << 23U;
  /// The clock's overflow interrupt comes no more, until a reset.
  void stop_clock();
  /// A reset by its pin, as when a program opens the serial port of an Arduino.
  void reset_by_pin();
  /// Outputs that the chip has driven low since the last call, bit k = line k.
  std::uint32_t take_driven_low();
  /// Level of an output pin.
  bool output(unsigned line) const;
  /// All edges of outputs and inputs since the last call.
  std::vector<MegaEdge> edges();
  /// The lowest address that the stack has reached, less the end of the variables: free bytes.
  unsigned stack_left() const;
  /// Bytes between the end of the variables and the end of the RAM.
  unsigned stack_room() const;
  /// Where a variable of the firmware is, in RAM; 0: there is no such symbol.
  unsigned place(const std::string& symbol) const;
  /// A variable of the firmware, by its symbol. 0 bytes: the image has no such symbol.
  std::vector<std::uint8_t> variable(const std::string& symbol, unsigned bytes) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  friend class MegaLink;
};

}  // namespace symrig::test

/// Skips where the image cannot be run, and says why.
#define NEEDS_MEGA() \
  if (const std::string why = ::symrig::test::EmulatedMega::missing(); !why.empty()) GTEST_SKIP() << why
