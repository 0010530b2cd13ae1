// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

namespace symrig {

struct MapQualityOptions {
  /// A pixel is lit if white − black is above this, in units of the photographs. The value is more than 10
  /// codes of 8 bits, plus half a code for rounding. It is less, in proportion, if the brightest hundredth of
  /// the pixels is below a quarter of the range.
  double lit_contrast = 10.5 / 255;
  double outlier = 1.5;  ///< [projector pixels] from the local affine fit
  int reach = 7;         ///< the fit uses (2 reach + 1)² camera pixels
  int least = 20;        ///< and needs this many valid pixels
  int stride = 1;        ///< judges every stride-th row and column
};

/// The smoothness of a pixel map, computed independently of the decoder. All shares but the first two are
/// shares of the judged pixels, which are valid and lit.
struct MapQuality {
  double lit_share = 0;           ///< lit / all camera pixels
  double valid_share = 0;         ///< lit pixels with a position / lit pixels
  double outlier_share = 0;       ///< further than `outlier` from the fit, or without a fit (alone_share)
  double axis_outlier_share = 0;  ///< further than `outlier` along one axis; mean of both axes
  double rms = 0;          ///< residual per axis of the pixels that are not outliers [projector pixels]
  double alone_share = 0;  ///< with fewer than `least` valid neighbours, or all of them on a line
};

/// Distances along both axes of the projector; NaN where there is no position or no fit.
struct MapResiduals {
  Image<float> col, row;

  /// Distance of one pixel [projector pixels].
  float distance(std::size_t pixel) const;
};

/// The distance of each valid position from an affine map that is fitted to the valid positions around it
/// [projector pixels]. The fit does not use the pixel itself. It is iteratively re-weighted least squares
/// (first absolute residuals, then Tukey's biweight at 4.685 robust sigmas). Where two surfaces meet, it
/// follows the one with more pixels. A map that was smoothed over neighbours looks better here than it is:
/// also test such a map on photographs that it has not used.
MapResiduals map_residuals(const PixelMap& map, const MapQualityOptions& options = {});

MapQuality judge_map(const PixelMap& map, const MapQualityOptions& options = {});
/// As above, with known residuals.
MapQuality judge_map(const PixelMap& map, const MapResiduals& residuals,
                     const MapQualityOptions& options = {});

}  // namespace symrig
