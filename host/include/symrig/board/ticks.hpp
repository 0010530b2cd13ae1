// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"

#include <compare>
#include <cstdint>

namespace symrig {

/// A point or span on the board's clock. A type of its own: only a TickRate converts it to Nanoseconds
/// (host).
struct Ticks {
  std::uint64_t count = 0;

  constexpr auto operator<=>(const Ticks&) const = default;  // NOLINT(modernize-use-nullptr): not a pointer
  constexpr Ticks operator+(Ticks other) const { return {count + other.count}; }
  constexpr Ticks operator-(Ticks other) const { return {count - other.count}; }
};

/// Ticks per second of one board's clock.
struct TickRate {
  std::uint64_t hz = 125'000'000;

  constexpr bool operator==(const TickRate&) const = default;

  /// Nearest tick, halves up. Exact for durations up to 290 years at any rate below 2^63 Hz; t >= 0.
  constexpr Ticks ticks(Nanoseconds t) const {
    const auto whole = static_cast<std::uint64_t>(t.count()) / kNano;
    const auto rest = static_cast<std::uint64_t>(t.count()) % kNano;
    return {whole * hz + (rest * hz + kNano / 2) / kNano};
  }
  /// Nearest nanosecond, halves up.
  constexpr Nanoseconds nanoseconds(Ticks t) const {
    const std::uint64_t whole = t.count / hz;
    const std::uint64_t rest = t.count % hz;
    return Nanoseconds(static_cast<std::int64_t>(whole * kNano + (rest * kNano + hz / 2) / hz));
  }

 private:
  static constexpr std::uint64_t kNano = 1'000'000'000;
};

}  // namespace symrig
