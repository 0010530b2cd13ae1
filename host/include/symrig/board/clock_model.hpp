// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board_info.hpp"

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>

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

/// One reading of the board's clock. It was `taken` when the request arrived and `answered` when the reply
/// went out. Both moments are between `sent` and `received`. If the host repeated the request, `sent` is the
/// first time: this holds whichever request the board answered.
struct TimeReading {
  HostTime sent, received;
  BoardTime taken, answered;
};

/// The assumptions about the two clocks together. Every bound of ClockModel depends on them and nothing else.
struct ClockLimits {
  double drift = 100e-6;            ///< |rate of the board / nominal rate / rate of the host - 1|, at most
  double wander_per_second = 1e-7;  ///< largest change of the drift in a second (0.1 ppm: 0.1 K/s at 1 ppm/K)
};

/// |true - at| <= bound.
struct BoardEstimate {
  BoardTime at;
  Ticks bound;
};
struct HostEstimate {
  HostTime at;
  Nanoseconds bound;
};

/// The board's rate against the host's, minus 1: between lowest and highest.
struct DriftEstimate {
  double lowest = 0, highest = 0;
};

/// The board's clock as a function of the host's clock, with a proven bound (not a fitted one):
/// docs/clock.md.
///
/// B(t), the board's clock at host time t, runs at f (1 + δ(t)), |δ| <= drift, |δ'| <= wander. A reading
/// means B(sent) < taken + 1 and B(received) >= answered, for any delays. At a time t these are half-planes
/// of the unknowns B(t) and δ(t). With d = sent - t, for every function δ within the limits,
///
///   B(t) + f d δ(t) <= taken + 1 - f d + f wander d²/2        (likewise from below, with received)
///
/// Their intersection is a convex polygon that contains the true point. Its extent in B(t) gives the result:
/// the estimate is the middle, the bound is half the width. The delays need no symmetry and no distribution;
/// a late answer only narrows the polygon less. Memory: the tightest readings of each of the last 32 seconds
/// (or the last 32 readings, if they came slower), less than 2 KB; no allocation.
///
/// If a clock breaks the limits, the polygon becomes empty after some time and add() fails. Until then the
/// bound is too small by at most the excess times its duration.
class ClockModel {
 public:
  explicit ClockModel(TickRate rate, const ClockLimits& limits = {}) : rate_(rate), limits_(limits) {}

  /// fails: bad_argument (times out of order), device_lost (the board's clock went back: it was restarted),
  /// limit (no clock within the limits fits all readings: the board was restarted, or drifts more). After a
  /// failure the model is unchanged; forget() empties it.
  Result<void> add(const TimeReading& reading);
  /// Drops all readings.
  void forget();

  /// These three fail with: bad_argument (no reading yet), limit (as add(), found at another time).
  /// They accept any time. Outside the readings the bound grows by wander and drift.
  Result<BoardEstimate> board_at(HostTime time) const;
  Result<HostEstimate> host_at(BoardTime time) const;
  Result<DriftEstimate> drift_at(HostTime time) const;

  TickRate rate() const { return rate_; }
  const ClockLimits& limits() const { return limits_; }

 private:
  /// B(host) is below (or not below) `board`.
  struct Side {
    HostTime host;
    BoardTime board;
  };
  static constexpr std::size_t kSlots = 32;

  /// The tightest readings of one side: one for each second, newest last.
  class Window {
   public:
    /// sign: +1 if a smaller board time is tighter, -1 if a larger one is. ticks_per_ns: to compare readings
    /// of the same second.
    void take(const Side& side, int sign, double ticks_per_ns);
    std::size_t size() const { return size_; }
    const Side& operator[](std::size_t k) const { return sides_[(first_ + k) % kSlots]; }
    void clear() { size_ = 0; }

   private:
    std::array<Side, kSlots> sides_{};
    HostTime slot_begin_{};
    std::size_t first_ = 0, size_ = 0;
  };

  /// The polygon at a time: y = B(t) - base in ticks, x = δ(t).
  struct Knowledge {
    double y_low, y_high;
    double x_low, x_high;
  };

  BoardTime nominal(HostTime time) const;
  std::optional<Knowledge> knowledge(HostTime time) const;
  Result<Knowledge> known(HostTime time) const;
  void insert(const TimeReading& reading);

  TickRate rate_;
  ClockLimits limits_;
  Window above_, below_;
  std::optional<TimeReading> last_;
};

}  // namespace symrig
