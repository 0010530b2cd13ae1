// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/steady_clock.hpp"
#include "symrig/board/receipt.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/rig/camera_ledger.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace symrig {

/// The line that shows the camera's exposures.
struct ExposureLine {
  int line = -1;  ///< number on the board
  bool active_low = false;
  Nanoseconds delay{0};   ///< from an edge of the line to what the camera does
  Nanoseconds offset{0};  ///< exposure time minus the time for which the line is active
  /// A pulse belongs to a mark if it begins at most this long after the mark.
  Nanoseconds tolerance{1'000'000};
};

/// A pulse or an exposure on the board's clock.
struct TickPulse {
  Ticks begin, end;
};

/// The exposures of one run, from the board.
struct BoardEvidence {
  std::vector<TickPulse> on_board;      ///< the exposure of every pulse of the line, on the board's clock
  std::vector<SeenExposure> exposures;  ///< the same on the host's clock, requested or not
  std::vector<Nanoseconds> widths;      ///< the exposure time of each pulse
  /// [first[i] + j]: the pulse of exposure j of photograph i. None: the camera made no exposure.
  std::vector<std::optional<std::size_t>> pulse_of;
  std::int64_t unanswered = 0;  ///< exposures without a pulse
  std::int64_t unasked = 0;     ///< pulses without an exposure in the program
};

/// Reads a receipt: assigns the pulses of the exposure line to marks by time, on the host's clock. A pulse
/// that begins or ends outside the run does not count.
/// first: index of the first exposure of each photograph, and the end of the last one.
/// fails: bad_argument (marks out of order), and as SteadyClock::at().
Result<BoardEvidence> board_evidence(const Receipt& receipt, const ExposureLine& line,
                                     std::span<const std::size_t> first, const SteadyClock& clock);

/// The camera's facts about a frame, with a hash of its content.
SeenFrame camera_evidence(const CameraFrame& frame, const NoiseModel& noise);

}  // namespace symrig
