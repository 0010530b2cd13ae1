// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace symrig {

/// Counts all frames since the camera was opened. Every dropped frame is counted here. A missing frame also
/// leaves a gap in CameraFrame::sequence.
struct StreamReport {
  std::uint64_t delivered = 0;   ///< returned by take(), or waiting in the queue
  std::uint64_t missing = 0;     ///< frame numbers that the driver skipped: lost frames
  std::uint64_t overflowed = 0;  ///< lost because the queue was full: take() was not called in time
  std::uint64_t stale = 0;       ///< older than the start of the stream; discarded
  std::uint64_t damaged = 0;     ///< delivered, but marked damaged by the driver, or too short
  std::uint64_t repeated = 0;    ///< delivered with the same number as the frame before
  std::uint64_t reordered = 0;   ///< delivered with a lower number than the frame before
  std::uint64_t unstamped = 0;   ///< delivered without a usable time stamp
  std::uint64_t errors = 0;      ///< attempts to take a frame that failed with a driver error
  std::uint64_t restarts = 0;    ///< how often the stream was reopened
  /// Remarks about the driver, each once: stamps of another clock, samples with more bits than stated, and so
  /// on.
  std::vector<std::string> notes;

  /// "812 frames, 2 missing, 1 damaged". Leaves out zeros.
  std::string to_string() const;
};

}  // namespace symrig
