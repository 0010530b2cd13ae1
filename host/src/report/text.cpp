// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>

#include <fmt/format.h>

namespace symrig::text {

std::string grouped(double number) {
  if (!(std::abs(number) < 1e15)) return short_number(number);
  const std::string digits = fmt::format("{:.0f}", std::abs(number));
  std::string out = number <= -0.5 ? "-" : "";
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) out += ',';
    out += digits[i];
  }
  return out;
}

std::string short_number(double number) {
  if (number == 0) return "0";
  const double size = std::abs(number);
  if (!(size >= 1e-4 && size < 1e6)) return fmt::format("{:.2e}", number);
  const int decimals = std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 7);
  return fmt::format("{:.{}f}", number, decimals);
}

std::string percent(double share) {
  if (share == 0) return "0 %";
  const double value = 100 * share;
  if (!(std::abs(value) >= 1e-3 && std::abs(value) < 1e6)) return fmt::format("{:.1e} %", value);
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 1, 5);
  return fmt::format("{:.{}f} %", value, decimals);
}

std::string byte_size(double bytes) {
  constexpr std::array<std::string_view, 6> kUnits{"bytes", "kB", "MB", "GB", "TB", "PB"};
  std::size_t unit = 0;
  for (; bytes >= 1000 && unit + 1 < kUnits.size(); ++unit) bytes /= 1000;
  return fmt::format("{:.{}f} {}", bytes, unit == 0 || bytes >= 100 ? 0 : 1, kUnits[unit]);
}

std::string duration(double seconds) {
  if (!(std::abs(seconds) < 1e12)) return short_number(seconds) + " s";
  if (seconds < 0.0095) return fmt::format("{:.2g} ms", seconds * 1e3);
  if (seconds < 1) return fmt::format("{:.0f} ms", seconds * 1e3);
  if (seconds < 60) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<std::int64_t>(std::llround(seconds));
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  if (whole < std::int64_t{48} * 3600) return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
  return fmt::format("{} days {} h", whole / 86400, whole % 86400 / 3600);
}

}  // namespace symrig::text
