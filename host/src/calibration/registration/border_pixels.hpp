// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/registration/stripe_pixels.hpp"

#include <optional>
#include <span>

namespace symrig::calibration {

/// What pixels near the border of two cells see of each.
///
/// A border between two cells is an edge of one pattern of the code, and that pattern and its complement
/// light at least two cells on either side of it. So their difference, as a share of their sum, goes from
/// that of the near cell to that of the far cell across the border. A pixel on the border lies between its
/// neighbours that see one cell only. Light that reaches the pixel from other points of the scene is nearly
/// the same in these neighbours, so it does not count.
class BorderPixels {
 public:
  /// surface: the map along this axis [cells]. blur: rms width of the optics' blur [cells]; neighbours within
  /// two of it see the border too. Both must outlive this.
  BorderPixels(const SplineSurface& surface, const StripePixels& pixels, StripeAxis axis, double blur)
      : surface_(surface), pixels_(pixels), axis_(axis), camera_(pixels.camera()), blur_(blur) {}

  /// What a point of the picture is to the axis.
  struct Place {
    double here;   ///< where it looks [cells]
    double width;  ///< of a pixel along the axis [cells]
    int border;    ///< the nearest one
    /// Part of a pixel in the middle of which the point lies is across the border.
    bool crossed() const { return 2 * std::abs(here - border) < width; }
  };
  Place place(Point at) const;

  /// A pixel's light from the second cell of a border less that from the first one, as a share of both: −1 or
  /// 1 if it sees one of them only, and a little beyond that by noise.
  struct Balance {
    double value, sigma;  ///< sigma: by the noise of the photographs
    double plain;         ///< StripePixels::balance, which blur and scattered light make smaller
    /// What of the light that follows wide stripes changes within a few pixels. The rest is scattered near.
    double sharp;
  };
  /// nullopt: no pattern has this border, or the neighbours do not tell.
  std::optional<Balance> balance(int row, int col, const Place& border) const;

  /// The share of a pixel's light that comes from the first of the cells that it sees along the axis. 1 if it
  /// sees one of them; kUnknownShare if the stripes do not tell.
  float share(int row, int col) const;

 private:
  std::size_t index(int row, int col) const {
    return static_cast<std::size_t>(std::int64_t{row} * camera_.cols + col);
  }
  std::optional<std::size_t> clear_neighbour(int row, int col, bool by_rows, int step,
                                             const Place& border) const;

  const SplineSurface& surface_;
  const StripePixels& pixels_;
  StripeAxis axis_;
  Grid camera_;
  double blur_;
};

/// BorderPixels::share of each camera pixel.
void fill_shares(const BorderPixels& borders, Grid camera, std::span<float> shares);

}  // namespace symrig::calibration
