// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

namespace symrig {

struct MapQualityOptions {
  /// Lit: white − black above this, units of the photographs. More than 10 codes of 8 bits, and half a code
  /// for rounding.
  double lit_contrast = 10.5 / 255;
  double outlier = 1.5;  ///< [projector pixels] from the local affine fit
  int reach = 7;         ///< the fit looks at (2 reach + 1)² camera pixels,
  int least = 20;        ///< and needs this many valid ones
  int stride = 1;        ///< judges every stride-th row and column
};

/// How smooth a pixel map is, by a judge that shares nothing with the decoder. All shares but the first two
/// are of the valid lit pixels that are judged.
struct MapQuality {
  double lit_share = 0;           ///< lit / all camera pixels
  double valid_share = 0;         ///< lit pixels with a position / lit pixels
  double outlier_share = 0;       ///< further than `outlier` from the fit, or without a fit (alone_share)
  double axis_outlier_share = 0;  ///< further than that along an axis; mean of both axes
  double rms = 0;                 ///< residual per axis of the pixels that are no outliers [projector pixels]
  double alone_share = 0;         ///< with fewer than `least` valid neighbours, or all of them on a line
};

/// Distances along both axes of the projector; NaN where there is no position, or no fit.
struct MapResiduals {
  Image<float> col, row;

  /// Distance of one pixel [projector pixels].
  float distance(std::size_t pixel) const;
};

/// How far each valid position lies from an affine map fitted to the valid positions around it [projector
/// pixels]. The pixel itself is left out. The fit is iteratively re-weighted least squares (first absolute
/// residuals, then Tukey's biweight at 4.685 robust sigmas); where two surfaces meet it is the one of the
/// majority. A map that was smoothed over neighbours looks better here than it is: judge such a map by
/// photographs that it has not seen, too.
MapResiduals map_residuals(const PixelMap& map, const MapQualityOptions& options = {});

MapQuality judge_map(const PixelMap& map, const MapQualityOptions& options = {});
/// The same of residuals that are known already.
MapQuality judge_map(const PixelMap& map, const MapResiduals& residuals,
                     const MapQualityOptions& options = {});

}  // namespace symrig
