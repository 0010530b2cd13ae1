// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/stripe_light.hpp"

#include <array>
#include <optional>

namespace symrig::calibration {

/// The contrast of all bits in a footprint while it moves over one projector pixel.
struct ShapedPixel {
  std::array<Steps, kMaxBits> contrast;  ///< of each bit; 0 for the left-out one
  Steps square;                          ///< Σ_k contrast_k², never 0
};

/// contrast_k(x) = Σ_s shape_s scales_ks(x). scales: [bit][scale], as StripeLight::at gives them.
void shape_pixel(const Steps* scales, int bits, const Shape& shape, std::optional<int> left_out,
                 ShapedPixel& to);

/// Normal equations of a footprint's shape for one pixel.
struct ShapeSums {
  std::array<ScaleLanes, kScales.size()> a;  ///< Σ_k weight m_k m_kᵀ
  ScaleLanes b;                              ///< Σ_k weight d_k m_k
};
void sum_shape(const ScaleLanes* m, const float* d, int bits, float weight, ShapeSums& to);

}  // namespace symrig::calibration
