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

namespace symrig {

namespace {

constexpr int kGlyphRows = 7;
constexpr int kGlyphCols = 5;
constexpr int kAdvance = kGlyphCols + 1;

struct Glyph {
  char letter;
  std::array<std::string_view, kGlyphRows> rows;
};

constexpr std::array<Glyph, 6> kGlyphs{{
    {'S', {" ####", "#    ", "#    ", " ### ", "    #", "    #", "#### "}},
    {'Y', {"#   #", "#   #", " # # ", "  #  ", "  #  ", "  #  ", "  #  "}},
    {'M', {"#   #", "## ##", "# # #", "# # #", "#   #", "#   #", "#   #"}},
    {'R', {"#### ", "#   #", "#   #", "#### ", "# #  ", "#  # ", "#   #"}},
    {'I', {" ### ", "  #  ", "  #  ", "  #  ", "  #  ", "  #  ", " ### "}},
    {'G', {" ####", "#    ", "#    ", "#  ##", "#   #", "#   #", " ####"}},
}};

/// The word divided into lines of `per_line` letters, on a grid of unit cells with a margin of one cell.
struct Layout {
  int per_line = 6;

  int lines() const { return static_cast<int>(kGlyphs.size()) / per_line; }
  int rows() const { return lines() * (kGlyphRows + 1) + 1; }
  int cols() const { return per_line * kAdvance + 1; }
  /// Cells per pixel when the layout just fits.
  double cell(Grid grid) const {
    return std::max(static_cast<double>(rows()) / grid.rows, static_cast<double>(cols()) / grid.cols);
  }

  bool ink(int row, int col) const {
    const int line = (row - 1) / (kGlyphRows + 1);
    const int place = (col - 1) / kAdvance;
    if (row < 1 || col < 1 || line >= lines() || place >= per_line) return false;
    const int r = (row - 1) % (kGlyphRows + 1);
    const int c = (col - 1) % kAdvance;
    if (r >= kGlyphRows || c >= kGlyphCols) return false;
    const auto index =
        static_cast<std::size_t>(line) * static_cast<std::size_t>(per_line) + static_cast<std::size_t>(place);
    return kGlyphs[index].rows[r][c] == '#';
  }
};

Layout largest(Grid grid) {
  const Layout one{6};
  const Layout two{3};
  return one.cell(grid) <= two.cell(grid) ? one : two;
}

}  // namespace

Image<float> letters_pattern(Grid grid) {
  constexpr int kSamples = 8;  // on each side of a pixel: coverage in steps of 1/64
  const Layout layout = largest(grid);
  const double cell = layout.cell(grid);
  const double top = 0.5 * (layout.rows() - cell * grid.rows);
  const double left = 0.5 * (layout.cols() - cell * grid.cols);
  const auto covered = [&](int row, int col) {
    int count = 0;
    for (int i = 0; i < kSamples; ++i)
      for (int j = 0; j < kSamples; ++j) {
        const double y = top + cell * (row + (i + 0.5) / kSamples);
        const double x = left + cell * (col + (j + 0.5) / kSamples);
        count += layout.ink(static_cast<int>(std::floor(y)), static_cast<int>(std::floor(x))) ? 1 : 0;
      }
    return static_cast<float>(count) / (kSamples * kSamples);
  };
  Image<float> picture(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) picture.at(row, col) = covered(row, col);
  return picture;
}

}  // namespace symrig
