// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

#include <cstdint>
#include <vector>

namespace symrig {

/// Converts pictures from the camera's grid to the projector's and back, through a pixel map. It is a sparse
/// matrix R, projector pixels × camera pixels. R_ji is the share of camera pixel i's light that came from
/// projector pixel j. Camera pixel i covers a box on the projector; R_ji is the part of the box in projector
/// pixel j. The sides of the box are the steps of the map from one camera pixel to the next, along both axes
/// of the projector.
/// Each decoded camera pixel distributes all of its light, Σ_j R_ji = 1, also at the projector's border; the
/// others distribute none. So Σ R x = Σ x over decoded pixels: no light is added or lost.
class Resampling {
 public:
  /// cost: 4 to 9 weights for each decoded pixel.
  /// fails: size_mismatch (images of the map differ in size), bad_value (a position is not finite, or is more
  /// than a pixel outside the projector).
  static Result<Resampling> from_map(const PixelMap& map);

  Grid camera() const { return camera_; }
  Grid projector() const { return projector_; }
  std::size_t weights() const { return weight_.size(); }

  /// R x: light on each projector pixel, any number of channels.
  /// error: sums are 64 bits wide, results are rounded to 32.
  /// fails: size_mismatch.
  Result<Image<float>> to_projector(const Image<float>& camera) const;
  /// Rᵀ y: the mean of a projector picture over each camera pixel's box; 0 where not decoded.
  /// fails: size_mismatch.
  Result<Image<float>> to_camera(const Image<float>& projector) const;
  /// R 1: the number of camera pixels that each projector pixel gets its light from; 0 where no camera pixel
  /// looks.
  const Image<float>& coverage() const { return coverage_; }
  /// R x / R 1, for quantities that are means and not sums (radiance, reflectance); 0 where no camera pixel
  /// looks. A camera pixel on the projector's border also sees the dark beside it, and would darken the mean.
  /// It counts only where no camera pixel lies completely on the projector.
  /// fails: size_mismatch.
  Result<Image<float>> mean_on_projector(const Image<float>& camera) const;

 private:
  Resampling(Grid camera, Grid projector) : camera_(camera), projector_(projector), inside_(camera) {}

  Grid camera_, projector_;
  std::vector<std::uint32_t> first_;  ///< first weight of each camera pixel, and the end
  std::vector<std::uint32_t> pixel_;  ///< projector pixel of each weight
  std::vector<float> weight_;
  Image<float> coverage_;
  Image<float> inside_;           ///< camera grid: 1 where the box lies completely on the projector
  Image<float> inside_coverage_;  ///< R inside
};

}  // namespace symrig
