// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <array>
#include <cstdint>
#include <string_view>

namespace symrig {

/// The colour that each pixel of a 2 × 2 cell sees: 0 red, 1 green, 2 blue, row by row.
struct BayerPattern {
  std::array<int, 4> colours{0, 1, 1, 2};

  constexpr int at(int row, int col) const { return colours[2 * (row % 2) + col % 2]; }
};
/// "RGGB", "GRBG", "GBRG", "BGGR".  fails: unknown_name.
Result<BayerPattern> parse_bayer(std::string_view name);

/// Colour from a mosaic alone: each colour of a pixel is the weighted mean of the samples of that colour in
/// the 3 × 3 pixels around it, weights 4 in the middle, 2 beside, 1 at the corners. It is linear: if patterns
/// add up to flood light, so do their photographs after it. But light on a single pixel is spread over its
/// neighbours, and two of its three colours are lost [Garg06 §5.3]. So use it for flood-lit photographs.
/// mosaic: grid × 1, merged as it came from the sensor. → grid × 3, variances of the means.
/// fails: size_mismatch (not one channel).
Result<Radiance> demosaic(const Radiance& mosaic, const BayerPattern& pattern);

/// The three colours of a mosaic as three channels. A pixel is valid in the channel of its own filter only.
/// mosaic: grid × 1. → grid × 3.  fails: size_mismatch (not one channel).
Result<Radiance> split_mosaic(const Radiance& mosaic, const BayerPattern& pattern);

/// Colour of any photograph from the colour of the flood-lit scene:
///   L_c(i) = y(i) · flood_c(i) / flood_own(i)
/// y: the photograph's sample at i, own: the colour that pixel i sees, flood: demosaic() of the flood-lit
/// mosaic. This is the renormalisation of [Garg06 §5.3] in one step. If patterns add up to flood light, their
/// photographs add up to the flood-lit photograph exactly, in each colour of each pixel. No light moves to
/// another pixel, and the sensor's own sample is unchanged. Departs from the paper: light gets its colour
/// directly, and is not rescaled after an interpolation. error: if a pixel's indirect light has another
/// colour than its flood-lit light, that colour is wrong; its own sample is right. Invalid where the mosaic
/// or its flood is invalid, or the flood is below 3 σ. fails: size_mismatch.
Result<Radiance> colour_by_flood(const Radiance& mosaic, const Radiance& flood_mosaic,
                                 const BayerPattern& pattern);

/// The factors of colour_by_flood(), in which the photograph has no part: its colours are its own samples
/// times these. grid × 3. flood: the flood-lit scene, each sample in the channel of its pixel's filter, 0
/// elsewhere. A pixel in the dark has no ratio to lend: it keeps its own colour alone.  fails: size_mismatch.
Result<Image<float>> colour_factors(const Image<float>& flood, const BayerPattern& pattern);

/// photograph: as flood of colour_factors().
Image<float> coloured(const Image<float>& photograph, const Image<float>& factors);

}  // namespace symrig
