// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/registration/spline_surface.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/image/radiance.hpp"

#include <optional>
#include <span>
#include <vector>

namespace symrig::calibration {

/// The stripes of a Gray-code sequence of cells, as the pixels of one channel see them.
class StripePixels {
 public:
  /// photographs: of all patterns of `code`, in order. They must outlive this.
  StripePixels(const GrayCode& code, std::span<const Radiance> photographs, int channel);

  /// Pixels that see the stripes: bright enough, and valid in all photographs.
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

  /// The middle of the cell that each good pixel sees along an axis, from the signs of its stripes.
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

}  // namespace symrig::calibration
