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

/// The part of Σ_k D_k² that the best a ≥ 0 explains if D_k = a contrast_k(x): (Σ D m)² / Σ m², or 0.
void explain(const Bits& seen, const ShapedPixel& light, int bits, Steps& to);

/// The contrast of one bit in all scales; the last lane is 0.
using ScaleLanes = std::array<float, kScales.size() + 1>;

/// Normal equations of a footprint's shape for one pixel.
struct ShapeSums {
  std::array<ScaleLanes, kScales.size()> a;  ///< Σ_k weight m_k m_kᵀ
  ScaleLanes b;                              ///< Σ_k weight d_k m_k
};
void sum_shape(const ScaleLanes* m, const float* d, int bits, float weight, ShapeSums& to);

}  // namespace symrig::calibration
