// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/board/clock_time.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <span>
#include <string>

namespace symrig {

/// Who makes a projector go on to its next pattern.
enum class Pacing : std::uint8_t {
  trigger,  ///< its trigger line: the pattern changes at the first refresh after the line rises
  host      ///< show(): the pattern is a picture on a screen of this machine
};

/// A pattern on the screen.
struct Shown {
  std::uint64_t refresh = 0;  ///< the display's own count of refreshes at which it appeared
  SteadyTime since;           ///< when that refresh began to be scanned out
  /// false: the display counts no refreshes. Then `refresh` counts shows, and `since` is when the picture was
  /// handed to the display.
  bool counted = true;
};

/// A projector that holds a sequence of patterns and shows one at a time. Not thread-safe.
class Projector {
 public:
  Projector() = default;
  Projector(const Projector&) = delete;
  Projector& operator=(const Projector&) = delete;
  virtual ~Projector() = default;

  virtual Grid grid() const = 0;
  virtual Nanoseconds refresh_period() const = 0;
  virtual Pacing pacing() const { return Pacing::trigger; }
  /// Takes a sequence. Pacing::trigger: the first pattern appears after the first trigger. The patterns live
  /// until the next load().  fails: size_mismatch, device_lost.
  virtual Result<void> load(std::span<const Pattern> patterns) = 0;
  /// Pacing::host only: puts pattern `index` of those loaded on the screen and returns once its first refresh
  /// has begun.  fails: bad_argument (no such pattern, or paced by trigger), device_lost (unplugged).
  virtual Result<Shown> show(std::size_t index);
  /// One line for reports.
  virtual std::string describe() const = 0;
};

}  // namespace symrig
