// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/letters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

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
