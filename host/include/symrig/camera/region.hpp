// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/mosaic.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/grid.hpp"

namespace symrig {

/// The part of a camera's picture that is kept, and its binning.
struct Region {
  int row = 0, col = 0;  ///< corner in the picture
  Grid size;             ///< {0, 0}: from the corner to the opposite end of the picture
  int binning = 1;       ///< sums binning × binning samples of one colour

  bool operator==(const Region&) const = default;
};

/// The grid after binning, and its colours. A mosaic stays a mosaic: samples of one colour are two pixels
/// apart, so a square of 2·binning pixels becomes 2 × 2 sums.
struct BinnedGrid {
  Grid grid;
  Mosaic mosaic = Mosaic::none;
};

/// picture: the size of the driver's picture.
/// fails: bad_argument (outside the picture, or not a whole number of squares; the hint gives the largest
/// region that fits).
Result<BinnedGrid> binned_grid(Grid picture, Mosaic mosaic, const Region& region);

/// The region with its real size instead of {0, 0}.
Region resolved(Grid picture, Region region);

/// How many bits the sum of n = binning² samples of `bits` bits is shifted right to fit into 16 bits.
int binning_shift(int bits, int binning);

/// The noise model of the binned codes: code = (Σ of n samples) / 2^s, rounded, with s = binning_shift().
///   gain' = gain / 2^s,  pedestal' = n pedestal / 2^s,  full well' = (2^bits' − 1 − pedestal') / gain'
///   Var'[code] = n Var[code] / 4^s + (1 − 4^−s) / 12            the last term: s bits rounded off
/// noise must be valid(). A bin with a saturated sample gets the largest code; FrameReader does this.
NoiseModel binned(const NoiseModel& noise, int binning);

}  // namespace symrig
