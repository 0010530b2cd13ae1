// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/statistics.hpp"
#include "symrig/board/clock_model.hpp"

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>

namespace symrig::test {

/// A board's clock whose drift against the host is known at every time: a constant and a slow sine.
struct TrueClock {
  double hz = 125e6;
  double drift = 40e-6;          ///< at time 0
  double wander = 2e-6;          ///< amplitude
  double wander_period = 600;    ///< seconds
  std::uint64_t begin = 12'345;  ///< ticks at time 0

  /// B(t), ticks since time 0: the integral of hz (1 + drift + wander sin(2π t / period)).
  long double ticks(double seconds) const {
    const long double t = seconds;
    const double turn = 2 * std::numbers::pi / wander_period;
    return static_cast<long double>(hz) *
           (t * (1 + static_cast<long double>(drift)) +
            static_cast<long double>(wander) / turn * (1 - std::cos(turn * seconds)));
  }
  BoardTime at(double seconds) const {
    const auto whole = static_cast<std::int64_t>(std::floor(ticks(seconds)));
    return {Ticks{begin + static_cast<std::uint64_t>(whole)}};
  }
  /// The steepest change of the drift within a second.
  double steepest() const { return wander * 2 * std::numbers::pi / wander_period; }
};

inline HostTime host_time(double seconds) {
  return {Nanoseconds{std::llround(1e9 * seconds)}};
}
inline double in_seconds(HostTime time) {
  return 1e-9 * static_cast<double>(time.since.count());
}

/// Draws one delay in seconds.
using Delay = std::function<double(Random&)>;

inline Delay exponential(double mean) {
  return [mean](Random& random) { return -mean * std::log(1 - random.uniform()); };
}
inline Delay uniform(double low, double high) {
  return [=](Random& random) { return low + (high - low) * random.uniform(); };
}
/// With probability p the second.
inline Delay either(const Delay& first, double p, const Delay& second) {
  return [=](Random& random) { return random.uniform() < p ? second(random) : first(random); };
}

/// The way to the board, what it needs to answer, and the way back.
struct Delays {
  Delay out, board, back;
};

/// The clock asked at `seconds` of the host's time.
inline TimeReading ask(const TrueClock& clock, const Delays& delays, double seconds, Random& random) {
  const double taken = seconds + delays.out(random);
  const double answered = taken + delays.board(random);
  const double received = answered + delays.back(random);
  // The host's readings of its own clock stand outside of what happened between them.
  return {HostTime{Nanoseconds{static_cast<std::int64_t>(std::floor(1e9 * seconds))}},
          HostTime{Nanoseconds{static_cast<std::int64_t>(std::ceil(1e9 * received))}}, clock.at(taken),
          clock.at(answered)};
}

/// |estimate - truth| in ticks, at a time that is whole nanoseconds.
inline double error_of(const BoardEstimate& estimate, const TrueClock& clock, HostTime time) {
  const auto whole = static_cast<std::int64_t>((estimate.at.since - Ticks{clock.begin}).count);
  return static_cast<double>(std::abs(static_cast<long double>(whole) - clock.ticks(in_seconds(time))));
}

}  // namespace symrig::test
