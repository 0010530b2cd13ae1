// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace symrig {

/// Where a pattern lies on a screen. Each of its pixels becomes a square of cell × cell screen pixels,
/// exactly:
///   screen(top + cell·r + i, left + cell·c + j) = pattern(r, c),  0 ≤ i, j < cell;
/// what is outside stays black. Nothing is ever scaled. Mirroring turns the whole screen over afterwards, for
/// projectors behind the scene (mirror_cols) or hung from the ceiling (both).
struct Placement {
  int cell = 1;  ///< screen pixels a pattern pixel, in both directions
  int top = 0;   ///< of the pattern's first row, screen pixels
  int left = 0;  ///< of the pattern's first column, screen pixels
  bool mirror_rows = false;
  bool mirror_cols = false;
};

/// The grid of the patterns that lie on a screen: `asked`, or else as many whole cells as fit.
/// fails: bad_argument (a cell below 1, a negative offset), size_mismatch (it does not fit).
Result<Grid> placed_grid(Grid screen, const Placement& placement, std::optional<Grid> asked = {});

/// Which 8-bit code a projector needs for which light. Without a measured response light is proportional to
/// the code: code = ⌊255·v + ½⌋. 0 and 1 are always the codes 0 and 255, so binary patterns are exact.
class CodeTable {
 public:
  CodeTable() = default;
  /// light: what was measured at each of the 256 codes, in any unit, never falling. A value v then gets the
  /// code whose light is nearest to l(0) + v·(l(255) − l(0)), of two equally near ones the lower.
  /// fails: bad_argument (not 256 of them), bad_value (not finite, falling, or no light at all).
  static Result<CodeTable> from_light(std::span<const double> light);

  /// v in [0, 1].
  std::uint8_t code(float v) const;
  bool measured() const { return !light_.empty(); }

 private:
  std::vector<double> light_;  // from 0 to 1; empty: proportional
};

/// The codes of a pattern, grid × 1. number: the pattern's place in its sequence, for the message.
/// fails: size_mismatch (another grid, or not one channel), bad_value (outside [0, 1] or NaN).
Result<Image<std::uint8_t>> to_codes(const Pattern& pattern, Grid grid, const CodeTable& table,
                                     std::size_t number);

/// A screen in the memory of a graphics card: rows of 0x00RRGGBB words, `pitch` words apart.
struct ScreenMemory {
  std::span<std::uint32_t> words;
  std::size_t pitch = 0;
  Grid grid;
};

/// Writes every pixel of the screen: codes where the placement puts them, grey (R = G = B), black elsewhere.
/// codes must fit (placed_grid). Memory is written in order and never read.
void draw(const Image<std::uint8_t>& codes, const Placement& placement, const ScreenMemory& screen);
/// The same as 8-bit codes, one channel.
Image<std::uint8_t> draw(const Image<std::uint8_t>& codes, const Placement& placement, Grid screen);

}  // namespace symrig
