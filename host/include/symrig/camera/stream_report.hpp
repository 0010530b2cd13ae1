// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace symrig {

/// What became of every frame that a camera told of since it was opened. Nothing is dropped without being
/// counted here, and whatever is missing is missing in CameraFrame::sequence too.
struct StreamReport {
  std::uint64_t delivered = 0;   ///< handed over, or waiting to be
  std::uint64_t missing = 0;     ///< numbers that the driver left out: frames it or the camera lost
  std::uint64_t overflowed = 0;  ///< came while the queue was full, because take() was not called in time
  std::uint64_t stale = 0;       ///< older than the start of the stream, thrown away
  std::uint64_t damaged = 0;     ///< of the delivered: marked by the driver, or too short
  std::uint64_t repeated = 0;    ///< of the delivered: with the number of the frame before
  std::uint64_t reordered = 0;   ///< of the delivered: with a number below that of the frame before
  std::uint64_t unstamped = 0;   ///< of the delivered: with a stamp that tells nothing
  std::uint64_t errors = 0;      ///< calls to take a frame that the driver ended with an error; no frame came
  std::uint64_t restarts = 0;    ///< times the stream was opened again
  /// What was noticed of the driver, one line each, each once: stamps of another clock, samples that have
  /// more bits than told, …
  std::vector<std::string> notes;

  /// "812 frames, 2 missing, 1 damaged": what is zero is left out.
  std::string to_string() const;
};

}  // namespace symrig
