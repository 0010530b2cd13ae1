// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace symrig {

/// A duration in the host's arithmetic. Board time is in ticks, which are another type (board module).
using Nanoseconds = std::chrono::duration<std::int64_t, std::nano>;

constexpr double seconds(Nanoseconds t) {
  return 1e-9 * static_cast<double>(t.count());
}

/// Time of the host's steady clock (CLOCK_MONOTONIC), which every link to a real board uses.
Nanoseconds steady_now();

/// Tells how long ago it was made. Assign a new one to start again.
class Stopwatch {
 public:
  Nanoseconds elapsed() const { return steady_now() - start_; }
  double seconds() const { return symrig::seconds(elapsed()); }

 private:
  Nanoseconds start_ = steady_now();
};

/// A moment of the steady clock: `wait` after it was made. For time-outs of waits in several steps.
class Deadline {
 public:
  explicit Deadline(Nanoseconds wait) : at_(steady_now() + wait) {}

  /// 0 from the moment on.
  Nanoseconds left() const;
  bool passed() const { return left().count() == 0; }

 private:
  Nanoseconds at_;
};

}  // namespace symrig

namespace symrig::base {

/// The form of durations in files, for messages.
inline constexpr const char* kDurationForm =
    "a number and a unit in quotes, such as \"1.5 ms\" (ns, us, ms, s)";

/// Parses "14.26 us", "1.5ms", "2 s", rounded to the nearest nanosecond, halves up. Nothing if the text is
/// not a duration, is negative, or is longer than 290 years.
std::optional<Nanoseconds> parse_duration(std::string_view text);

/// A duration as text, exact to the nanosecond and as short as possible: "1.5 ms", "20 us", "40 ns", "2.5 s".
std::string duration_text(Nanoseconds duration);

}  // namespace symrig::base
