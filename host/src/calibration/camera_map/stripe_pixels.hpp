// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/fitting/spline_surface.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/image/image.hpp"

#include <optional>
#include <span>
#include <vector>

namespace symrig::calibration {

/// The stripes of a Gray-code sequence of cells, as the pixels of one channel see them.
class StripePixels {
 public:
  /// photographs: of all patterns of `code`, in order. They must outlive this.
  StripePixels(const GrayCode& code, std::span<const Radiance> photographs, int channel);

  /// Pixels that see the stripes: bright enough, valid in all photographs, and lit by their own cells.
  bool good(std::size_t pixel) const { return direct_[pixel] > 0; }
  std::size_t count_good() const;
  /// The share of a pixel's light that follows every stripe of an axis, but for one that may have an edge in
  /// the pixel. The rest comes from elsewhere in the scene: some stripes light that, and others do not.
  double follows_all(std::size_t pixel, StripeAxis axis) const;
  /// Cells along an axis.
  int size(StripeAxis axis) const {
    return axis == StripeAxis::columns ? code_.projector().cols : code_.projector().rows;
  }
  Grid camera() const { return photographs_.front().mean.grid(); }

  /// The middle of the cell that each good pixel sees along an axis, from the signs of its stripes. Without
  /// faint pixels, which may see a ghost.
  std::vector<SeenValue> decoded(StripeAxis axis) const;

  /// The contrast of the finest stripes divided by that of stripes four times as wide, mean of the good
  /// pixels. 1: both optics are sharp; indirect light lowers both alike.
  double finest_contrast(StripeAxis axis) const;

  /// What a pixel tells about the border between cells `border` − 1 and `border`: its light from the far side
  /// less that from the near side, as a share of its direct light, −1 to 1. nullopt: no pattern has this
  /// border, or the pixel does not see stripes.
  std::optional<double> balance(std::size_t pixel, StripeAxis axis, int border) const;
  /// Standard deviation of balance() by the noise of the photographs.
  double balance_sigma(std::size_t pixel, StripeAxis axis, int border) const;

 private:
  /// (pattern − complement) / (pattern + complement)
  double ratio(std::size_t pixel, int pair) const;
  int first_pair(StripeAxis axis) const { return axis == StripeAxis::columns ? 0 : code_.column_bits(); }
  std::optional<int> pair_at(StripeAxis axis, int border) const;
  float direct_share(std::size_t pixel) const;

  const GrayCode& code_;
  std::span<const Radiance> photographs_;
  int channel_;
  std::vector<float> direct_;  // share of a pixel's light that follows the stripes; 0: not good
};

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
  struct PointOnAxis {
    double here;   ///< where it looks [cells]
    double width;  ///< of a pixel along the axis [cells]
    int border;    ///< the nearest one
    /// Part of a pixel in the middle of which the point lies is across the border.
    bool crossed() const { return 2 * std::abs(here - border) < width; }
  };
  PointOnAxis place(Point at) const;

  /// A pixel's light from the second cell of a border less that from the first one, as a share of both: −1 or
  /// 1 if it sees one of them only, and a little beyond that by noise.
  struct Balance {
    double value, sigma;  ///< sigma: by the noise of the photographs
    double plain;         ///< StripePixels::balance, which blur and scattered light make smaller
    /// What of the light that follows wide stripes changes within a few pixels. The rest is scattered near.
    double sharp;
  };
  /// nullopt: no pattern has this border, or the neighbours do not tell.
  std::optional<Balance> balance(int row, int col, const PointOnAxis& border) const;

  /// The share of a pixel's light that comes from the first of the cells that it sees along the axis. 1 if it
  /// sees one of them; kUnknownShare if the stripes do not tell.
  float share(int row, int col) const;

 private:
  std::size_t index(int row, int col) const {
    return static_cast<std::size_t>(std::int64_t{row} * camera_.cols + col);
  }
  std::optional<std::size_t> clear_neighbour(int row, int col, bool by_rows, int step,
                                             const PointOnAxis& border) const;

  const SplineSurface& surface_;
  const StripePixels& pixels_;
  StripeAxis axis_;
  Grid camera_;
  double blur_;
};

/// BorderPixels::share of each camera pixel.
void fill_shares(const BorderPixels& borders, Grid camera, std::span<float> shares);

}  // namespace symrig::calibration
