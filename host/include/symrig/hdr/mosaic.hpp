// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/radiance.hpp"

#include <array>
#include <cstdint>
#include <string_view>

namespace symrig {

/// Which colour each pixel of a 2 × 2 cell sees: 0 red, 1 green, 2 blue, row by row.
struct BayerPattern {
  std::array<int, 4> colours{0, 1, 1, 2};

  int at(int row, int col) const { return colours[static_cast<std::size_t>(2 * (row % 2) + col % 2)]; }
};
/// "RGGB", "GRBG", "GBRG", "BGGR".  fails: unknown_name.
Result<BayerPattern> parse_bayer(std::string_view name);

/// Colour from a mosaic alone: each colour of a pixel is the weighted mean of the samples of that colour in
/// the 3 × 3 pixels around it, weights 4 in the middle, 2 beside, 1 at the corners. Linear, so photographs of
/// patterns that add up to flood light add up to it afterwards too; but light on a single pixel is spread
/// over its neighbours, and two of its three colours are lost [Garg06 §5.3]. For flood-lit photographs.
/// mosaic: grid × 1, merged as it came from the sensor. → grid × 3, variances of the means.
/// fails: size_mismatch (not one channel).
Result<Radiance> demosaic(const Radiance& mosaic, const BayerPattern& pattern);

/// Colour of any photograph by that of the flood-lit scene:
///   L_c(i) = y(i) · flood_c(i) / flood_own(i)
/// y: the photograph's sample at i, own: the colour that pixel i sees, flood: demosaic() of the flood-lit
/// mosaic. The renormalisation of [Garg06 §5.3] in one step: photographs of patterns that add up to flood
/// light add up to the flood-lit photograph in each colour of each pixel exactly, no light is moved to
/// another pixel, and the sensor's own sample is kept as it is. Departs from it in that light is told its
/// colour, not rescaled after interpolation. error: where a pixel's indirect light has another colour than
/// its flood-lit light, that colour is wrong; its own sample is not. Invalid where the mosaic or its flood
/// is, or its flood is below 3 σ. fails: size_mismatch.
Result<Radiance> colour_by_flood(const Radiance& mosaic, const Radiance& flood_mosaic,
                                 const BayerPattern& pattern);

}  // namespace symrig
