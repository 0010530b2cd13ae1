// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace symrig {

/// Where a pattern lies on a screen. Each pattern pixel becomes a square of exactly cell × cell screen
/// pixels:
///   screen(top + cell·r + i, left + cell·c + j) = pattern(r, c),  0 ≤ i, j < cell.
/// Other screen pixels stay black. Nothing is scaled. Mirroring then flips the whole screen, for rear
/// projection (mirror_cols) or a projector that hangs from the ceiling (both).
struct Placement {
  int cell = 1;  ///< screen pixels per pattern pixel, in both directions
  int top = 0;   ///< screen row of the pattern's first row
  int left = 0;  ///< screen column of the pattern's first column
  bool mirror_rows = false;
  bool mirror_cols = false;
};

/// The grid of patterns on a screen: `asked`, or else as many whole cells as fit.
/// fails: bad_argument (cell below 1, negative offset), size_mismatch (does not fit).
Result<Grid> placed_grid(Grid screen, const Placement& placement, std::optional<Grid> asked = {});

/// Converts light to the projector's 8-bit codes. Without a measured response, light is proportional to the
/// code: code = ⌊255·v + ½⌋. 0 and 1 are always the codes 0 and 255, so binary patterns are exact.
class CodeTable {
 public:
  CodeTable() = default;
  /// light: the measured light at each of the 256 codes, in any unit, never decreasing. A value v gets the
  /// code whose light is nearest to l(0) + v·(l(255) − l(0)). Of two equally near codes, it gets the lower
  /// one.
  /// fails: bad_argument (not 256 values), bad_value (not finite, decreasing, or constant).
  static Result<CodeTable> from_light(std::span<const double> light);

  /// v in [0, 1].
  std::uint8_t code(float v) const;
  bool measured() const { return !light_.empty(); }

 private:
  std::vector<double> light_;  // scaled from 0 to 1; empty: proportional
};

/// The codes of a pattern, grid × 1. number: the pattern's index in its sequence, for the error message.
/// fails: size_mismatch (another grid, or not one channel), bad_value (outside [0, 1] or NaN).
Result<Image<std::uint8_t>> to_codes(const Pattern& pattern, Grid grid, const CodeTable& table,
                                     std::size_t number);

/// A picture in graphics memory: rows of 0x00RRGGBB words. `pitch` is the distance between rows in words.
struct ScreenMemory {
  std::span<std::uint32_t> words;
  std::size_t pitch = 0;
  Grid grid;
};

/// Writes every pixel of the screen: codes as grey (R = G = B) at the placement, and black elsewhere. codes
/// must fit (placed_grid). Writes the memory in order and never reads it.
void draw(const Image<std::uint8_t>& codes, const Placement& placement, const ScreenMemory& screen);
/// The same with a word for each pattern pixel instead of a grey code.
void draw(const Image<std::uint32_t>& words, const Placement& placement, const ScreenMemory& screen);
/// The same as 8-bit codes with one channel.
Image<std::uint8_t> draw(const Image<std::uint8_t>& codes, const Placement& placement, Grid screen);

}  // namespace symrig
