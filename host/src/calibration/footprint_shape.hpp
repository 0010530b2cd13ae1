// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/stripe_search.hpp"

#include <array>

namespace symrig::calibration {

/// Least squares of a footprint's shape, summed pixel by pixel: D_k / contrast ≈ Σ_s shape_s m_k(x; s).
class ShapeFit {
 public:
  /// Adds one pixel at a known position. contrast: white − black, units of the photographs.
  void add(const StripeLight& light, std::optional<int> left_out, double position, const Differences& seen,
           float contrast);
  ShapeFit& operator+=(const ShapeFit& other);
  /// The shape ≥ 0, with the prior that each share is that of `usual` ± 1 / √pull. `usual` if nothing was
  /// added.
  Shape solve(const Shape& usual, double pull) const;
  double pixels() const { return pixels_; }
  /// The mean information of one pixel about one share.
  double information() const;

 private:
  static constexpr std::size_t kSize = kScales.size();
  using Vector = std::array<double, kSize>;
  using Matrix = std::array<Vector, kSize>;

  Matrix a_{};
  Vector b_{};
  double pixels_ = 0;
};

}  // namespace symrig::calibration
