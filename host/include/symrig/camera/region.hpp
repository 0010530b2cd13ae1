// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/mosaic.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/grid.hpp"

namespace symrig {

/// The pixels of a camera's picture that are kept, and how many of them become one.
struct Region {
  int row = 0, col = 0;  ///< its corner in the picture
  Grid size;             ///< {0, 0}: from the corner to the end of the picture
  int binning = 1;       ///< binning × binning samples of one colour are summed

  bool operator==(const Region&) const = default;
};

/// What comes out: the grid of sums and its colours. A mosaic stays one: samples of one colour stand two
/// pixels apart, so that squares of 2·binning pixels become 2 × 2 sums.
struct BinnedGrid {
  Grid grid;
  Mosaic mosaic = Mosaic::none;
};

/// picture: the driver's.  fails: bad_argument (outside of the picture; not a whole number of squares: the
/// hint names the largest region that is).
Result<BinnedGrid> binned_grid(Grid picture, Mosaic mosaic, const Region& region);

/// The region with its size filled in.
Region resolved(Grid picture, Region region);

/// Bits that are taken off the sum of n = binning² samples of `bits` bits so that it fits into 16.
int binning_shift(int bits, int binning);

/// The sensor that the sums come from: code = (Σ of n samples) / 2^s, rounded, with s = binning_shift().
///   gain' = gain / 2^s,  pedestal' = n pedestal / 2^s,  full well' = (2^bits' − 1 − pedestal') / gain'
///   Var'[code] = n Var[code] / 4^s + (1 − 4^−s) / 12            rounding off s bits
/// noise must be valid(). A bin with a saturated sample is the largest code, as FrameReader makes it.
NoiseModel binned(const NoiseModel& noise, int binning);

}  // namespace symrig
