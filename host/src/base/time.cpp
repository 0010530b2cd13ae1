// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/time.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

namespace symrig {

Nanoseconds steady_now() {
  return std::chrono::duration_cast<Nanoseconds>(std::chrono::steady_clock::now().time_since_epoch());
}

Nanoseconds Deadline::left() const {
  return std::max(at_ - steady_now(), Nanoseconds{0});
}

}  // namespace symrig

namespace symrig::base {
namespace {

constexpr std::array<std::pair<std::string_view, std::int64_t>, 5> kUnits{
    {{"ns", 1}, {"us", 1'000}, {"µs", 1'000}, {"ms", 1'000'000}, {"s", 1'000'000'000}}};

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Removes the digits at the beginning of a text and returns them.
std::string_view take_digits(std::string_view& text) {
  std::size_t count = 0;
  while (count < text.size() && is_digit(text[count])) ++count;
  const std::string_view digits = text.substr(0, count);
  text.remove_prefix(count);
  return digits;
}

std::optional<std::int64_t> whole(std::string_view digits, std::int64_t unit) {
  std::int64_t value = 0;
  for (const char c : digits)
    if (__builtin_mul_overflow(value, 10, &value) || __builtin_add_overflow(value, c - '0', &value))
      return {};
  if (__builtin_mul_overflow(value, unit, &value)) return {};
  return value;
}

/// The nanoseconds of the fraction 0.d1d2d3... of a unit. The first digit below one nanosecond decides the
/// rounding; halves round up.
std::int64_t fraction(std::string_view digits, std::int64_t unit) {
  std::int64_t value = 0;
  for (const char c : digits) {
    if (unit == 1) return value + (c >= '5' ? 1 : 0);
    unit /= 10;
    value += unit * (c - '0');
  }
  return value;
}

}  // namespace

std::optional<Nanoseconds> parse_duration(std::string_view text) {
  const std::string_view before = take_digits(text);
  std::string_view after;
  if (!text.empty() && text.front() == '.') {
    text.remove_prefix(1);
    after = take_digits(text);
    if (after.empty()) return {};
  }
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  if (before.empty()) return {};
  for (const auto& [name, unit] : kUnits) {
    if (text != name) continue;
    const auto base = whole(before, unit);
    std::int64_t sum = 0;
    if (!base || __builtin_add_overflow(*base, fraction(after, unit), &sum)) return {};
    return Nanoseconds(sum);
  }
  return {};
}

std::string duration_text(Nanoseconds duration) {
  const std::int64_t ns = duration.count();
  constexpr std::array<std::pair<std::int64_t, const char*>, 3> kCoarseUnits{
      {{1'000'000'000, "s"}, {1'000'000, "ms"}, {1'000, "us"}}};
  for (const auto& [unit, name] : kCoarseUnits)
    if (ns >= unit) return fmt::format("{} {}", static_cast<double>(ns) / static_cast<double>(unit), name);
  return fmt::format("{} ns", ns);
}

}  // namespace symrig::base
