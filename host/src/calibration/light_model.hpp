// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/footprint.hpp"
#include "calibration/pixel_light.hpp"
#include "calibration/surroundings.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <array>
#include <span>
#include <vector>

namespace symrig::calibration {

/// The footprint of one camera pixel on the projector: separable, Σ = 1.
struct Footprint {
  Taps col, row;
};

Footprint footprint(const PixelMap& map, std::size_t pixel, double sigma);

/// A blur, and its squared residual in a sample of the pixels.
struct Blur {
  double sigma = 0;
  double squared_residual = 0;
};

/// The photographs that a fit may use, and the light of their patterns on a pixel's footprint and
/// surroundings.
class LightModel {
 public:
  /// Leaves out DecodeOptions::held_out_pair. All arguments must outlive the model.
  LightModel(const CodePhotographs& photographs, const DecodeOptions& options,
             std::span<const Surroundings> surroundings);

  std::size_t photographs() const { return seen_.size(); }

  /// Light of one camera pixel, at this blur [projector pixels].
  PixelLight fit(const PixelMap& map, std::size_t pixel, double sigma) const;
  std::vector<PixelLight> fit_all(const PixelMap& map, double sigma) const;
  /// The blur with the least residual over a sample of the decoded pixels.
  Blur best_blur(const PixelMap& map) const;

 private:
  /// One photograph. Its pattern changes along one axis (white and black along none).
  struct Observation {
    const float* pixels = nullptr;
    StripeAxis axis = StripeAxis::columns;
    std::vector<float> stripes;                         ///< the pattern along its axis
    std::array<std::vector<float>, kNearSizes> blocks;  ///< its means over the blocks of each surroundings
    double mean = 0;                                    ///< its mean over the projector
  };

  Observation observe(const CodePhotographs& photographs, int index) const;
  double squared_residual(const PixelMap& map, double sigma) const;

  std::span<const Surroundings> surroundings_;  ///< kNearSizes of them
  double model_error_;                          ///< DecodePolicy::model_error
  std::vector<Observation> seen_;
};

}  // namespace symrig::calibration
