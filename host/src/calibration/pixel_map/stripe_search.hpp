// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/pixel_map/stripe_light.hpp"

#include <array>
#include <memory>
#include <optional>
#include <vector>

namespace symrig::calibration {

/// The position that a pixel sees along one axis, by maximum likelihood.
struct StripeSighting {
  float position = 0;  ///< [projector pixels]
  int index = 0;       ///< the step next to it, position ≈ index / kSteps
  float chi2 = 0;      ///< of the fit, bits − 2 degrees of freedom
  float rival =
      0;  ///< χ² of the best position more than two pixels away; infinity if none is near `evidence`
  bool bit_value = false;  ///< the value of a left-out bit
};

/// The contrast of the stripes in a footprint of one shape, cached.
class ShapedLight {
 public:
  ShapedLight(const StripeLight& light, std::optional<int> left_out);

  /// Sets the shape and clears the cache.
  void set_shape(const Shape& shape);
  const ShapedPixel& pixel(int pixel) {
    const std::size_t i = pixel;
    if (stamp_[i] != now_) compute(i);
    return known_[i];
  }
  const StripeLight& light() const { return light_; }
  std::optional<int> left_out() const { return left_out_; }

 private:
  void compute(std::size_t pixel);

  const StripeLight& light_;
  std::optional<int> left_out_;
  Shape shape_{};
  std::unique_ptr<ShapedPixel[]> known_;  ///< of each projector pixel; valid where the stamp is of now
  std::vector<std::uint32_t> stamp_;
  std::uint32_t now_ = 0;
};

/// The measurement of one pixel for one axis: pattern minus complement, bit by bit, and the variance of each.
struct Differences {
  Bits value{};
  float variance = 1;
};

/// The part of Σ_k D_k² that the best a ≥ 0 explains if D_k = a contrast_k(x): (Σ D m)² / Σ m², or 0.
void explain(const Bits& seen, const ShapedPixel& light, int bits, Steps& to);

/// The position that explains the differences best: min over x and a ≥ 0 of Σ_k (D_k − a m_k(x))² / V, with m
/// the shaped contrast. The candidates are the positions that the signs of D give, and those with any of the
/// three smallest |D_k| reversed. Each is searched ± 1 pixel in steps of an eighth, then with a parabola.
/// A candidate is skipped if its reversed bits alone cost more χ² than the best one and `evidence`: no
/// position with the wrong sign of bit k explains any of D_k. bit_value: the value of a left-out bit.
/// nullopt: no candidate lies on the projector.
std::optional<StripeSighting> find_position(ShapedLight& light, const Differences& seen, float evidence,
                                            bool bit_value = false);

/// Standard deviation of a found position [projector pixels], from the Fisher information of x with a
/// unknown; infinity without information.
float deviation(ShapedLight& light, const Differences& seen, int index);

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
