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

/// What advances a projector to its next pattern.
enum class Pacing : std::uint8_t {
  trigger,  ///< its trigger line: the pattern changes at the first refresh after the rising edge
  host      ///< show(): the pattern is a picture on a screen of this computer
};

/// When a pattern appeared on the screen.
struct Shown {
  std::uint64_t refresh = 0;  ///< the display's refresh count when the pattern appeared
  SteadyTime since;           ///< when the scan-out of that refresh began
  /// false: the display does not count refreshes. Then `refresh` counts calls of show(), and `since` is the
  /// time when the display got the picture.
  bool counted = true;
};

/// A projector that holds a sequence of patterns and shows one of them at a time. Not thread-safe.
class Projector {
 public:
  Projector() = default;
  Projector(const Projector&) = delete;
  Projector& operator=(const Projector&) = delete;
  virtual ~Projector() = default;

  virtual Grid grid() const = 0;
  virtual Nanoseconds refresh_period() const = 0;
  virtual Pacing pacing() const { return Pacing::trigger; }
  /// Loads a sequence. With Pacing::trigger, the first pattern appears after the first trigger. The patterns
  /// stay loaded until the next load().
  /// fails: size_mismatch, device_lost.
  virtual Result<void> load(std::span<const Pattern> patterns) = 0;
  /// Pacing::host only. Shows the loaded pattern `index`, and returns when its first refresh has begun.
  /// fails: bad_argument (no such pattern, or Pacing::trigger), device_lost (unplugged).
  virtual Result<Shown> show(std::size_t index);
  /// One line for reports.
  virtual std::string describe() const = 0;
};

}  // namespace symrig
