// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"
#include "symrig/board/ticks.hpp"

#include <compare>

namespace symrig {

/// A point on a clock. Points of one clock have a difference and an order. Code that mixes points of two
/// clocks does not compile: only a ClockModel converts one into the other.
template <class Clock, class Span>
struct PointOnClock {
  Span since{};  ///< since the clock began

  constexpr auto operator<=>(const PointOnClock&) const =
      default;  // NOLINT(modernize-use-nullptr): not a pointer
  constexpr PointOnClock operator+(Span span) const { return {since + span}; }
  constexpr PointOnClock operator-(Span span) const { return {since - span}; }
  constexpr Span operator-(PointOnClock other) const { return since - other.since; }
};

/// The board's clock: ticks since power-up, modulo 2^64.
using BoardTime = PointOnClock<struct BoardClock, Ticks>;
/// The clock of the link that leads to the board (Link::now()).
using HostTime = PointOnClock<struct HostClock, Nanoseconds>;
/// CLOCK_MONOTONIC of this machine. V4L2 stamps frames with it, and DRM stamps refreshes with it.
using SteadyTime = PointOnClock<struct MonotonicClock, Nanoseconds>;

}  // namespace symrig
