// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/stripe_kernels.hpp"

#include <optional>
#include <vector>

namespace symrig::calibration {

/// Where a pixel looks along one axis, by maximum likelihood.
struct Sighting {
  float position = 0;  ///< [projector pixels]
  float sigma = 0;     ///< its standard deviation [projector pixels]; infinity where nothing tells
  float chi2 = 0;      ///< of the fit, bits − 2 degrees of freedom
  float rival = 0;     ///< χ² of the best position that is more than two pixels away; infinity without one
};

/// What a footprint of one shape sees of the stripes, remembered.
class ShapedLight {
 public:
  ShapedLight(const StripeLight& light, std::optional<int> left_out);

  /// Forgets what was remembered.
  void set_shape(const Shape& shape);
  const ShapedPixel& pixel(int pixel) {
    const auto i = static_cast<std::size_t>(pixel);
    if (stamp_[i] != now_) compute(i);
    return known_[i];
  }
  /// contrast of all bits at position index / kSteps.
  Bits at(int index);
  const StripeLight& light() const { return light_; }
  std::optional<int> left_out() const { return left_out_; }

 private:
  void compute(std::size_t pixel);

  const StripeLight& light_;
  std::optional<int> left_out_;
  Shape shape_{};
  std::vector<ShapedPixel> known_;
  std::vector<std::uint32_t> stamp_;
  std::uint32_t now_ = 0;
};

/// What one pixel saw of one axis: pattern less complement, bit by bit, and the variance of each.
struct Differences {
  Bits value{};
  float variance = 1;
};

/// The position that explains the differences best: min over x and a ≥ 0 of Σ_k (D_k − a m_k(x))² / V, m the
/// shaped contrast. Tried are the positions that the signs of D spell, and those with any of the three
/// smallest |D_k| the other way round; each is searched ± 1 pixel in steps of an eighth, then a parabola.
/// sigma: Fisher information of x with a unknown. bit_value: which value of a left-out bit is looked at.
/// nullopt: no position on the projector is spelt.
std::optional<Sighting> find_position(ShapedLight& light, const Differences& seen, bool bit_value = false);

}  // namespace symrig::calibration
