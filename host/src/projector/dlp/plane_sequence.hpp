// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/controller.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::projector::dlp {

/// Bit planes of a 24-bit picture.
inline constexpr int kMostPlanes = 24;

/// What a sequence of bit planes shall be, with any controller.
struct PlaneOptions {
  int planes = kMostPlanes;                  ///< in each picture
  std::optional<std::uint32_t> period_us;    ///< from plane to plane; none: the longest that fits
  std::optional<std::uint32_t> exposure_us;  ///< none: the period
  std::uint8_t leds = kAllLeds;
  std::optional<LedCurrents> led_currents;              ///< none: as they are
  bool plane_inverted = false, frame_inverted = false;  ///< the trigger outputs are active low
  Nanoseconds plane_delay{0};                           ///< of the plane trigger against its plane
  /// Of the frame trigger against the first plane. It comes before the first edge of the plane trigger, so
  /// that the order of the two is certain.
  Nanoseconds frame_delay{-20'000};
  Nanoseconds lock_patience{5'000'000'000};  ///< longest wait until the controller has locked to the signal
};

/// A sequence of 1-bit patterns: a plane of the picture each.
struct Sequence {
  int planes = kMostPlanes;
  std::uint32_t exposure_us = 0;
  std::uint32_t period_us = 0;  ///< from plane to plane
  std::uint8_t leds = kAllLeds;
};

/// The least times of a controller, in microseconds.
struct PlaneLimits {
  std::uint32_t exposure;  ///< of a 1-bit pattern
  /// Of the black after the last plane, and of a period that is longer than its exposure.
  std::uint32_t load;
};

/// The longest period for `planes` planes in a refresh. It leaves room for the black after the last plane,
/// and for a source that is 0.1 % too fast. fails: limit (the planes do not fit).
Result<std::uint32_t> longest_period(int planes, Nanoseconds refresh, const PlaneLimits& limits);

/// What the controller would refuse, and what it would not notice: planes that do not fit into a refresh of
/// the source. fails: bad_argument, limit; the message names the nearest legal value.
Result<void> check_sequence(const Sequence& sequence, Nanoseconds refresh, const PlaneLimits& limits);

/// The sequence that the options ask for. fails: as check_sequence().
Result<Sequence> sequence_of(const PlaneOptions& options, Nanoseconds refresh, const PlaneLimits& limits);

/// A controller that splits each picture of its video port into bit planes, until this object is destroyed.
class PlaneSequence {
 public:
  PlaneSequence() = default;
  PlaneSequence(const PlaneSequence&) = delete;
  PlaneSequence& operator=(const PlaneSequence&) = delete;
  virtual ~PlaneSequence() = default;

  virtual const Sequence& sequence() const = 0;
  virtual const std::string& name() const = 0;
  virtual Version version() const = 0;
  /// Checks that the sequence still runs. fails: device_lost (it was reset, or another program changed it),
  /// as Controller.
  virtual Result<void> check() = 0;
  /// What a user must know, one line each.
  virtual std::vector<std::string> warnings() const { return {}; }
};

}  // namespace symrig::projector::dlp
