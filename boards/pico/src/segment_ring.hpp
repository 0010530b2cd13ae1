// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "registers.hpp"

namespace symrig::pico {

/// Passes words from firmware to the edge engine's queue by DMA. DMA never reads a word that firmware has not
/// finished.
///
/// The data channel copies words from a ring to the state machine's queue, and stops after a given count.
/// Then the control channel gives it the next count from a list of counts ("grants"). A zero in the list
/// stops both channels. Firmware writes words first and their grant afterwards, so every granted word is
/// complete. If the channels reached the zero before a new grant was there, firmware starts them again. The
/// data channel's interrupt flag reports this: in quiet mode it flags only a zero.
class SegmentRing {
 public:
  static constexpr uint32_t kSegments = 1024;
  static constexpr uint32_t kWords = 2 * kSegments;
  /// One slot stays free to distinguish "all read" from "none read".
  static constexpr uint32_t kCapacity = kSegments - 1;

  /// Stops both channels and discards all words.
  void reset();
  /// Writes the two words of a segment. Only if used() < kCapacity.
  void write(uint32_t first, uint32_t second);
  /// Grants everything that is written.
  void grant();
  /// Starts the channels: from now on grants reach the queue.
  void open();
  /// Grants what is written if the channels have few grants left, and restarts stopped channels. Call it in
  /// every round of the main loop.
  void service();

  /// Times at which a channel had halted because of a bus error. No word follows then until reset(), so the
  /// queue runs empty.
  uint32_t errors() const { return errors_; }
  /// Segments that are written and not yet read.
  uint32_t used() const { return (static_cast<uint32_t>(written_) - place()) % kWords / 2; }
  /// Index of the next word to read.
  static uint32_t place();
  /// Words read since reset(). Must be called (grant() does it) before another full ring has been read.
  uint64_t read_words() const;

 private:
  static constexpr uint32_t kGrants = 64;
  static constexpr uint32_t kGrantEvery = 2 * 64;  // words; one DMA interrupt each

  uint32_t grants_unread() const;
  void restart() const;

  uint64_t written_ = 0;  // words since reset()
  uint64_t granted_ = 0;  // words since reset()
  uint64_t read_ = 0;
  uint32_t errors_ = 0;
  uint32_t grants_ = 0;  // number of grants since reset()
  bool open_ = false;
};

}  // namespace symrig::pico
