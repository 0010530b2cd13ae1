// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/plane_sequence.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::projector::dlpc900 {

/// An entry of the pattern table (DLPU018J, "Pattern Display LUT Definition"). The controller does not tell
/// its entries again.
struct TableEntry {
  int index = 0;
  std::uint32_t exposure_us = 0;  ///< 24 bits
  int bits = 1;                   ///< bit depth, 1 to 8
  std::uint8_t leds = dlp::kAllLeds;
  bool waits = false;         ///< for the trigger; in video-pattern mode VSYNC
  bool clears = false;        ///< black after the pattern; only 1-bit patterns with a trigger
  std::uint32_t dark_us = 0;  ///< after the exposure, 24 bits
  bool no_trigger_2 = false;  ///< TRIG_OUT_2 has no pulse
  int bit = 0;                ///< of the picture's 24: the first one of the pattern
  bool operator==(const TableEntry&) const = default;
};
inline constexpr std::size_t kEntryBytes = 12;
dlp::Bytes to_bytes(const TableEntry& entry);

/// The table of a video sequence: entry k shows bit k. VSYNC begins it (DLPU018J, table 5-1). The last entry
/// is cleared, so that nothing is bright until then: a public program for this mode found that it stays else
/// (importly/dmdcontrol, display_sequence.py).
std::vector<TableEntry> video_table(const dlp::Sequence& sequence);

/// The least exposure of a 1-bit pattern of the DLP6500 and the DLP9000 is 105 us (DLPU018J, "Minimum
/// Exposure in Any Pattern Mode"), as long as the black before a pattern with a trigger. A sequence that has
/// not ended at the next VSYNC is broken off (section 5.1). A public program for this mode leaves 250 us
/// (importly/dmdcontrol, constants.py); so does symrig.
inline constexpr dlp::PlaneLimits kPlaneLimits{105, 250};

/// What "Reading Hardware Configuration" tells (DLPU018J, 0x0206).
struct Mirrors {
  std::string_view name;
  Grid grid;
};
/// None: an unknown kind.
std::optional<Mirrors> mirrors_of(std::uint8_t type);

/// A trigger output (DLPU018J, "Trigger Out 1"). Delays in microseconds, -20 to 20,000. TRIG_OUT_1 is active
/// while a pattern is bright: `rising` counts from its begin, `falling` from its end. TRIG_OUT_2 has a pulse
/// at the begin of each pattern: both count from there.
struct TriggerOut {
  bool inverted = false;
  std::int16_t rising = 0, falling = 0;
  bool operator==(const TriggerOut&) const = default;
};
/// fails: bad_argument (outside of the range).
Result<std::int16_t> delay_us(Nanoseconds delay);

}  // namespace symrig::projector::dlpc900
