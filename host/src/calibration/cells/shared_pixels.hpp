// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Dense>

namespace symrig::calibration {

/// The light of camera pixels that no cell has for itself, for one channel.
///
/// A cell is measured by its core, the pixels inside it: a plane through the ratio of the photograph to the
/// flood-lit one says what the rest of the cell looks like (Weighting::cores). So the planes of the cells say
/// what a pixel on their borders should see, ŷ = Σ f W r, with the cell's share f of the flood-lit light W,
/// and the plane's ratio r there. What it sees beyond that, e = y − ŷ, is light that the planes do not
/// describe, such as the edge of a mirrored cell. It belongs to the pixel's cells, so that no light is lost.
///
/// Each cell gets the part of e that its own error explains. Both the plane and the share may be wrong:
///   part = τ² / Σ τ²,   τ² = ((f + kShareError) W r)² + kNoise f² σ²
/// So the error of a lit cell stays with it, however dark the other cell is, and where the light is less than
/// its noise σ, the shares decide. This makes a photograph of the cells follow superposition only as far as
/// the planes describe it.
class SharedPixels {
 public:
  /// The error of a share f, in units of the relative error of a plane: shares are known to about 0.01, and
  /// planes to some hundredths of the light.
  static constexpr float kShareError = 0.2F;
  /// Variances of the pixel's noise. With less, the parts would follow the noise of the planes.
  static constexpr float kNoise = 4;

  /// A cell that a shared pixel sees.
  struct CellShare {
    std::uint32_t cell;
    float row, col;  ///< the middle of the overlap, from the middle of the cell [cells]
    float share;     ///< f
    float weight;    ///< the area of the pixel, divided by that of the cell
  };
  /// A core pixel: where it lies from the middle of its cell [cells].
  struct CorePoint {
    float row, col;
  };
  /// The photograph of one channel, and the camera pixels of all cores: those of cell i are [first[i],
  /// first[i + 1]).
  struct Photograph {
    std::span<const float> mean, variance;
    std::span<const std::uint8_t> valid;
    std::span<const std::uint32_t> first, pixel;
  };

  explicit SharedPixels(std::size_t cells) : cells_(cells) {}

  /// The next cell, in order. normal: Σ W φ φᵀ over the core, φ = (1, row, col). slopes: the core tells them.
  /// places: of its core pixels; light: W there, 0 for those without a valid W. Without places: a cell that
  /// is not measured by a core.
  void add_cell(const Eigen::Matrix3d& normal, bool slopes, std::span<const CorePoint> places,
                std::span<const float> light);
  /// parts: of cells that have a core. light: W > 0.
  void add_pixel(std::uint32_t pixel, float light, std::span<const CellShare> parts);
  /// After all cells and pixels.
  void finish();

  /// The variance of a cell, divided by that of its core alone with the weights k. For pixels of one
  /// variance, and parts of the excess that only the shares decide.
  double noise(std::size_t cell, std::span<const float> k) const;

  /// Adds what the shared pixels see beyond the planes to the cells, and to their variance how uncertain it
  /// is which cell it belongs to. scale: of each cell; 0 leaves it as it is.
  void add(const Photograph& photograph, std::span<const float> scale, std::span<float> mean,
           std::span<float> variance) const;

  /// For comparison: CRC-32C of all numbers.
  std::uint32_t digest() const;

 private:
  struct Cell {
    std::array<float, 6> inverse;  ///< of the normal matrix: 00 01 02 11 12 22
  };
  struct Pixel {
    std::uint32_t pixel, first, last;  ///< its parts
    float light;
  };
  using RatioPlane = std::array<float, 3>;
  /// What a shared pixel gives to a cell beyond its plane.
  struct Excess {
    float light = 0;
    float doubt = 0;  ///< variance of the light
  };

  Eigen::Matrix3d inverse(std::size_t cell) const;
  RatioPlane plane(const Photograph& photograph, std::size_t cell) const;
  static float ratio(const RatioPlane& plane, const CellShare& part) {
    return plane[0] + plane[1] * part.row + plane[2] * part.col;
  }
  /// light: of the cell in the pixel, without its share: W r.
  static float tau_square(const CellShare& part, float light, float variance) {
    const float wrong = (part.share + kShareError) * light;
    return wrong * wrong + kNoise * part.share * part.share * variance;
  }

  std::size_t cells_;
  std::vector<Cell> cell_;
  std::vector<std::uint32_t> first_place_{0};  // of each cell
  std::vector<CorePoint> places_;
  std::vector<float> light_;  // of each place
  std::vector<Pixel> pixels_;
  std::vector<CellShare> parts_;
  std::vector<std::uint32_t> first_of_cell_;  // in of_cell_
  std::vector<std::uint32_t> of_cell_;        // parts of each cell
};

}  // namespace symrig::calibration
