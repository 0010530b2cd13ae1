// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc350/dialogue.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::projector::dlpc350 {

/// Bit planes of a 24-bit picture.
inline constexpr int kMostPlanes = 24;

/// The bit of a 0x00RRGGBB word that is pattern `plane` of a sequence: the planes are G0 to G7, R0 to R7, B0
/// to B7 (DLPU010, table 2-66; not checked on hardware).
constexpr int bit_of_plane(int plane) {
  constexpr std::array kFirstBit{8, 16, 0};  // green, red, blue
  return kFirstBit[static_cast<std::size_t>(plane / 8)] + plane % 8;
}

/// What begins a pattern (DLPU010, table 2-65).
enum class Trigger : std::uint8_t {
  internal = 0,
  rising = 1,  ///< an outer rising edge; in a video sequence VSYNC
  falling = 2,
  continues = 3  ///< the end of the pattern before
};

/// LEDs by bits: red, green, blue.
inline constexpr std::uint8_t kAllLeds = 7;

/// An entry of the pattern table (DLPU010, table 2-65).
struct TableEntry {
  Trigger trigger = Trigger::continues;
  int plane = 0;  ///< number of the pattern; for 1 bit the plane
  int bits = 1;   ///< bit depth, 1 to 8
  std::uint8_t leds = kAllLeds;
  bool inverted = false;
  bool black_after = false;   ///< black after the pattern; the controller needs 230 us for it
  bool swaps_buffer = false;  ///< the pattern is of the next picture
  bool joins = false;         ///< TRIG_OUT_1 stays high between the pattern before and this one
  bool operator==(const TableEntry&) const = default;
};

inline constexpr std::size_t kEntryBytes = 3;
std::array<std::uint8_t, kEntryBytes> to_bytes(const TableEntry& entry);
TableEntry entry_of(std::span<const std::uint8_t, kEntryBytes> bytes);

/// The table of a video sequence: plane k is entry k. VSYNC begins it, and black follows the last plane, so
/// that nothing is bright until the next picture.
std::vector<TableEntry> video_table(int planes, std::uint8_t leds);

/// Delay of a trigger output against its pattern. Unit 107.2 ns; 0xBB is no delay (DLPU010, "Trigger Out
/// Control").
inline constexpr int kNoDelay = 0xBB;
inline constexpr int kMostDelay = 0xD5;
inline constexpr double kDelayUnit = 107.2;  ///< ns

/// fails: bad_argument (outside of -20.05 us to +2.79 us).
Result<std::uint8_t> delay_code(Nanoseconds delay);

struct TriggerOut {
  bool inverted = false;  ///< active low
  std::uint8_t rising = kNoDelay;
  std::uint8_t falling = kNoDelay;  ///< TRIG_OUT_1 only
  bool operator==(const TriggerOut&) const = default;
};

/// The least exposures by bit depth, in microseconds: 1 to 8 bits (DLPU010, "Pattern Display Exposure and
/// Frame Period", as TI's interface program checks them).
inline constexpr std::array<std::uint32_t, 8> kLeastExposure{235, 700, 1570, 1700, 2000, 2500, 4500, 8333};
/// Black after a pattern, or a period that is longer than the exposure, takes this long (same section).
inline constexpr std::uint32_t kLoadTime = 230;

/// The video signal at the controller's input.
struct Signal {
  bool locked = false;
  int rows = 0, cols = 0;
  double refresh_hz = 0;  ///< 0: unknown
};

/// A video sequence of 1-bit patterns.
struct Sequence {
  int planes = kMostPlanes;
  std::uint32_t exposure_us = 0;
  std::uint32_t period_us = 0;  ///< from plane to plane
  std::uint8_t leds = kAllLeds;
};

/// The longest period for `planes` planes in a refresh. It leaves room for the black after the last plane,
/// and for a source that is 0.1 % too fast. fails: limit (the planes do not fit).
Result<std::uint32_t> longest_period(int planes, Nanoseconds refresh);

/// What the controller would refuse, and what it would not notice: planes that do not fit into a refresh of
/// the source. fails: bad_argument, limit; the message names the nearest legal value.
Result<void> check_sequence(const Sequence& sequence, Nanoseconds refresh);

}  // namespace symrig::projector::dlpc350
