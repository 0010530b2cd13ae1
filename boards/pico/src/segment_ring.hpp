// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "registers.hpp"

namespace symrig::pico {

/// Words on their way from firmware to the edge engine's queue, by DMA, so that DMA can never read a word
/// that firmware has not finished.
///
/// The data channel copies words from a ring to the state machine's queue. It is given a count and stops
/// after it; the control channel then hands it the next count from a list of counts ("grants"), or a zero,
/// which stops both. Firmware writes words first and their grant after them, so every word granted is a
/// finished one. If the channels have met the zero before a new grant stood there, firmware starts them
/// again: the data channel tells of that by its interrupt flag (it is "quiet": it flags nothing but a zero).
class SegmentRing {
 public:
  static constexpr uint32_t kSegments = 1024;
  static constexpr uint32_t kWords = 2 * kSegments;
  /// One slot stays free, so that "all read" and "none read" differ.
  static constexpr uint32_t kCapacity = kSegments - 1;

  /// Stops both channels and forgets all words.
  void reset();
  /// Writes a segment's two words. Only with used() < kCapacity.
  void write(uint32_t first, uint32_t second);
  /// Makes everything written available.
  void grant();
  /// Lets the channels run: from now on grants reach the queue.
  void open();
  /// Grants what is written if the channels are about to run out of grants, and starts them again if they
  /// have stopped. To be called at every round of the main loop.
  void service();

  /// Segments written and not yet read.
  uint32_t used() const { return (static_cast<uint32_t>(written_) - place()) % kWords / 2; }
  /// Words read since reset(). Must be asked (grant() does) before another ring's worth has been read.
  uint64_t read_words() const;

 private:
  static constexpr uint32_t kGrants = 64;
  static constexpr uint32_t kGrantEvery = 2 * 128;  // words; a DMA interrupt each

  /// Index of the word that is read next.
  static uint32_t place();
  uint32_t grants_unread() const;
  void restart() const;

  uint64_t written_ = 0;  // words since reset
  uint64_t granted_ = 0;  // of them
  uint64_t read_ = 0;
  uint32_t grants_ = 0;  // grants written since reset
  bool open_ = false;
};

}  // namespace symrig::pico
