// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/board/program.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// What the projector and the camera need. Defaults: a 60 Hz projector, a camera that reads out in 3 ms.
/// Without a projector line nobody is asked for a pattern, without a vsync line nothing is waited for.
struct RigProfile {
  std::string projector_line = "projector_trigger";
  std::string camera_line = "camera_trigger";
  std::string vsync_line = "vsync";
  Nanoseconds advance_pulse{100'000};      ///< width of the pulse that asks for the next pattern
  Nanoseconds refresh_period{16'666'667};  ///< of the projector
  Nanoseconds light_period{0};             ///< of a lamp or wheel that makes up white in time; 0: steady
  Nanoseconds vsync_timeout{50'000'000};   ///< no vsync for that long: the run aborts
  Nanoseconds settle{1'000'000};           ///< from vsync to the first exposure
  Nanoseconds readout{4'000'000};          ///< from the end of an exposure to the next trigger, at least
  Nanoseconds min_exposure{20'000};        ///< of the camera
  Nanoseconds exposure_offset{0};          ///< the camera exposes that much longer than its pulse
  bool projector_active_low = false;       ///< lines that are on when low
  bool camera_active_low = false;
  bool whole_refreshes =
      false;  ///< exposures must be whole refresh periods (multi-bit patterns made in time)
};

/// Mark ids of compiled brackets: 0 when a pattern is asked for, 1 + j when exposure j begins.
inline constexpr std::uint32_t kMarkPattern = 0;
constexpr std::uint32_t mark_of_exposure(std::size_t j) {
  return static_cast<std::uint32_t>(1 + j);
}

/// `photographs` times: next pattern → wait for vsync → settle → expose × k → readout.
/// exposures: k durations, the same for every photograph. Ends with all lines low.
/// fails: bad_argument (the rule broken and the nearest legal value are named), unknown_name (a line).
Result<Program> compile_bracket(const BoardInfo& board, const RigProfile& profile,
                                std::span<const Nanoseconds> exposures, std::uint32_t photographs);

/// The same with its own exposures for each photograph: brackets[i] are those of photograph i.
Result<Program> compile_brackets(const BoardInfo& board, const RigProfile& profile,
                                 std::span<const std::vector<Nanoseconds>> brackets);

}  // namespace symrig
