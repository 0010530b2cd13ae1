// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace symrig::calibration {

/// Largest number of bits of one axis: for projectors up to 65536 pixels wide.
inline constexpr int kMaxBits = 16;

/// A footprint is a mixture of Gaussians of these sigmas [projector pixels], four in each decade. They
/// describe the optics (projector, camera, camera pixel). The two widest describe light that scatters in
/// surfaces and lenses.
inline constexpr std::array<double, 7> kScales{0.25, 0.44, 0.79, 1.41, 2.5, 8, 32};
/// Share of each Gaussian in the light that a footprint collects; Σ ≤ 1, the rest is not local.
using Shape = std::array<float, kScales.size()>;

/// One value for each Gaussian; the last lane is 0.
using ScaleLanes = std::array<float, kScales.size() + 1>;

/// One value for each bit.
using Bits = std::array<float, kMaxBits>;

/// Positions are tried in steps of 1 / kSteps pixel.
inline constexpr int kSteps = 8;
/// One value for each step within a pixel: [x, x + 1).
using Steps = std::array<float, kSteps>;

/// The contrast of the stripe patterns of one axis in footprints, for every position in steps of 1 / kSteps
/// pixel. contrast_k(x; s) = light of pattern k minus light of its complement, −1..1, in a Gaussian of sigma
/// s around x, integrated over the projector's pixels. It includes the dark outside the border.
class StripeLight {
 public:
  StripeLight(const GrayCode& code, StripeAxis axis);

  int bits() const { return bits_; }
  int size() const { return size_; }  ///< of the axis [projector pixels]
  int positions() const { return (size_ - 1) * kSteps + 1; }

  /// contrast_k(x; s) for x from `pixel` to just below pixel + 1: [bit][scale].
  const Steps* at(int pixel) const { return table_.data() + offset(pixel, 0); }
  /// contrast_k(x; s) of all bits and scales, linear between the steps. to: [bit].
  void contrasts(double x, ScaleLanes* to) const;

 private:
  std::size_t offset(int pixel, int bit) const {
    return (static_cast<std::size_t>(pixel) * static_cast<std::size_t>(bits_) +
            static_cast<std::size_t>(bit)) *
           kScales.size();
  }
  void fill(std::span<const float> stripes, int bit);

  int bits_, size_;
  std::vector<Steps> table_;        ///< [pixel][bit][scale]
  std::vector<ScaleLanes> scales_;  ///< the same: [pixel][step][bit]
};

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
