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

/// The line that shows when the camera exposed.
struct ExposureLine {
  int line = -1;  ///< number on the board
  bool active_low = false;
  Nanoseconds offset{0};  ///< the camera exposes that much longer than the line is active
  /// A pulse belongs to a mark if it begins at most this long after it.
  Nanoseconds tolerance{1'000'000};
};

/// What the board tells of one run.
struct BoardEvidence {
  std::vector<SeenExposure> exposures;  ///< every pulse of the line, asked for or not
  std::vector<Nanoseconds> widths;      ///< of each: how long the camera exposed
  /// The pulse of exposure j of photograph i at [first[i] + j]; none: the camera made none.
  std::vector<std::optional<std::size_t>> pulse_of;
  std::int64_t unanswered = 0;  ///< exposures without a pulse
  std::int64_t unasked = 0;     ///< pulses that no exposure asked for
};

/// Reads a receipt: pulses of the exposure line, each tied to its mark by time, on the host's clock. A pulse
/// that begins or ends outside the run leaves its exposure unanswered.
/// first: number of the first exposure of each photograph, and the end of the last one.
/// fails: bad_argument (marks out of order), and as SteadyClock::at().
Result<BoardEvidence> board_evidence(const Receipt& receipt, const ExposureLine& line,
                                     std::span<const std::size_t> first, const SteadyClock& clock);

/// What the camera tells of a frame, its content boiled down to a number.
SeenFrame camera_evidence(const CameraFrame& frame, const NoiseModel& noise);

}  // namespace symrig
