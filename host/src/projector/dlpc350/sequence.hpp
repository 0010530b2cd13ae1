// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/plane_sequence.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace symrig::projector::dlpc350 {

/// What begins a pattern (DLPU010, table 2-65).
enum class Trigger : std::uint8_t {
  internal = 0,
  rising = 1,  ///< an outer rising edge; in a video sequence VSYNC
  falling = 2,
  continues = 3  ///< the end of the pattern before
};

/// An entry of the pattern table (DLPU010, table 2-65).
struct TableEntry {
  Trigger trigger = Trigger::continues;
  int plane = 0;  ///< number of the pattern; for 1 bit the plane
  int bits = 1;   ///< bit depth, 1 to 8
  std::uint8_t leds = dlp::kAllLeds;
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

/// The least exposure of a 1-bit pattern, and the time for black or dark time after it (DLPU010, "Pattern
/// Display Exposure and Frame Period", as TI's interface program checks them).
inline constexpr dlp::PlaneLimits kPlaneLimits{235, 230};

}  // namespace symrig::projector::dlpc350
