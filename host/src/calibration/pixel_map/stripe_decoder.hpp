// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/pixel_map/stripe_search.hpp"
#include "calibration/sequence/photograph_noise.hpp"
#include "symrig/calibration/pixel_map.hpp"

#include <algorithm>
#include <vector>

namespace symrig::calibration {

/// Sightings of one axis, camera grid.
struct AxisSightings {
  Image<float> position, sigma;
  Image<float> misfit;        ///< χ² / degrees of freedom
  Image<std::uint8_t> clear;  ///< no rival position explains the photographs nearly as well
};

/// Decodes one axis of all pixels, each from its own photographs alone. Pixels share only the footprint's
/// shape: it is fitted to squares of kTile × kTile camera pixels.
class StripeDecoder {
 public:
  static constexpr int kTile = 16;

  StripeDecoder(const CodePhotographs& photographs, StripeAxis axis, const DecodeOptions& options,
                const NoiseLine& noise, const Image<std::uint8_t>& lit);

  /// Only pixels of `wanted` (1) are decoded; the others keep sigma = infinity and clear = 0.
  AxisSightings decode(const Image<std::uint8_t>& wanted) const;

  Differences differences(std::size_t pixel) const;
  /// Sum of the squared differences of the two finest bits, relative to the noise: 2 on average for noise
  /// alone.
  float fine_energy(std::size_t pixel) const;

 private:
  struct Tiles {
    int rows = 0, cols = 0;
    std::vector<Shape> shape;
    Shape& at(int row, int col) {
      return shape[static_cast<std::size_t>(row) * static_cast<std::size_t>(cols) +
                   static_cast<std::size_t>(col)];
    }
  };

  Shape fit_usual_shape(const Shape& guess) const;
  ShapeFit fit_tile(ShapedLight& light, int tile_row, int tile_col) const;
  Tiles fit_tiles() const;
  std::optional<StripeSighting> sight(const Differences& seen, ShapedLight& light) const;
  /// light: set to the tile's shape. own: storage for the pixel's own shape.
  void decode_pixel(std::size_t pixel, const Shape& shape, ShapedLight& light, ShapedLight& own,
                    AxisSightings& out) const;
  float reflected(float position) const;
  float evidence() const { return static_cast<float>(options_.policy.evidence); }
  float freedom() const { return static_cast<float>(std::max(light_.bits() - (left_out_ ? 3 : 2), 1)); }
  float contrast(std::size_t pixel) const { return white_[pixel] - black_[pixel]; }

  const DecodeOptions& options_;
  const NoiseLine& noise_;
  const Image<std::uint8_t>& lit_;
  StripeLight light_;
  /// The photographs of this axis, by pixels.
  struct Pair {
    const float *pattern, *complement;
  };
  std::array<Pair, kMaxBits> pairs_;
  const float *white_, *black_;
  std::optional<int> left_out_;
  Shape usual_;
};

}  // namespace symrig::calibration
