// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

#include <cstdint>
#include <vector>

namespace symrig {

/// Brings pictures from the camera's grid to the projector's and back, through a pixel map: a sparse matrix
/// R, projector pixels × camera pixels. R_ji is the share of camera pixel i's light that came from projector
/// pixel j: the box that the camera pixel covers on the projector (its sides: how far the map runs from one
/// camera pixel to the next, along both axes of the projector), cut by projector pixel j. Each decoded camera
/// pixel hands out all of its light, Σ_j R_ji = 1, at the projector's border too; the others hand out none.
/// So Σ R x = Σ x over decoded pixels: light is neither made nor lost.
class Resampling {
 public:
  /// cost: 4 to 9 weights a decoded pixel. fails: size_mismatch (images of the map differ in size), bad_value
  /// (a position is not finite, or lies off the projector by more than a pixel).
  static Result<Resampling> from_map(const PixelMap& map);

  Grid camera() const { return camera_; }
  Grid projector() const { return projector_; }
  std::size_t weights() const { return weight_.size(); }

  /// R x: light on each projector pixel, any number of channels. error: sums are 64 bits wide, results
  /// rounded to
  /// 32. fails: size_mismatch.
  Result<Image<float>> to_projector(const Image<float>& camera) const;
  /// Rᵀ y: what each camera pixel sees of a picture on the projector, the mean over its box; 0 where not
  /// decoded. fails: size_mismatch.
  Result<Image<float>> to_camera(const Image<float>& projector) const;
  /// R 1: how many camera pixels each projector pixel gets its light from; 0 where none looks.
  const Image<float>& coverage() const { return coverage_; }
  /// R x / R 1, for what is a mean and not a sum (radiance, reflectance); 0 where no camera pixel looks. A
  /// camera pixel that the projector's border cuts sees dark beside it, and would darken the mean: it counts
  /// only where no pixel that lies wholly on the projector tells. fails: size_mismatch.
  Result<Image<float>> mean_on_projector(const Image<float>& camera) const;

 private:
  Resampling(Grid camera, Grid projector) : camera_(camera), projector_(projector), inside_(camera) {}

  Grid camera_, projector_;
  std::vector<std::uint32_t> first_;  ///< first weight of each camera pixel, and the end
  std::vector<std::uint32_t> pixel_;  ///< projector pixel of each weight
  std::vector<float> weight_;
  Image<float> coverage_;
  Image<float> inside_;           ///< camera grid: 1 where the box lies wholly on the projector
  Image<float> inside_coverage_;  ///< R inside
};

}  // namespace symrig
