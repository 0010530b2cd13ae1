// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/hdr/mosaic.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace symrig {

struct CameraGhost;
namespace calibration {
class GhostSubtraction;
class SharedPixels;
}  // namespace calibration

/// How camera pixels become the cells of the projector.
enum class Weighting : std::uint8_t {
  /// A cell is the mean over its area: z = Σ A y / Σ A, with A the area of each camera pixel inside the cell.
  /// Pixels on a border count for both cells, so direct light spreads by about a sixth of a pixel's width.
  area,
  /// Only pixels that lie wholly inside a cell, at least `margin` from its border, count. So no direct light
  /// spreads, if the projector is sharp. The flood-lit photograph W says what the border shows: the ratio
  /// y / W is a plane over the cell, fitted to its core, and z = Σ A W (y / W) / Σ A. What pixels on a border
  /// see beyond the planes of their cells is shared among these. A cell without such pixels is weighted by
  /// area.
  cores,
  /// The camera has a pixel for each cell, shifted by little (largest_shift). Each pixel shows parts of up to
  /// four cells, and the cells are the solution of these equations. It is exact for cells of constant light.
  unmixed,
};

std::string_view to_string(Weighting weighting);

struct WeightOptions {
  Weighting weighting = Weighting::cores;
  /// [cells] Of a core from the border of its cell: three times the rms error of the corner map.
  double margin = 0.02;
  /// A cell of which the camera sees a smaller share is not valid.
  double least_cover = 0.5;
};

/// In `shares`: not known.
constexpr float kUnknownShare = -1;

/// A sparse matrix from the camera's pixels to the projector's cells. Thread-safe for reading.
class CellWeights {
 public:
  /// cells: the projector's cells. corners: where the camera's pixels lie on them, one map for each channel
  /// or one for all. flood: photograph of the flood-lit scene on the camera's grid, without noise worth
  /// mentioning; its channels are those of the photographs.
  /// shares: for cores, two values for each map and pixel: the share of the pixel's flood-lit light that
  /// comes from the first row of the cells that it sees, and from the first column. Then a pixel on a border
  /// counts for each cell by its light. kUnknownShare, or no shares: by its area.
  /// cost: 1 (cores) to 2 (area) weights for each camera pixel.
  /// fails: size_mismatch; bad_value (a corner is not finite, or a share not from 0 to 1).
  static Result<CellWeights> make(Grid cells, std::span<const CornerMap> corners, const Radiance& flood,
                                  const WeightOptions& options = {}, const Image<float>* shares = nullptr);

  /// The same of a camera with a colour mosaic: photographs have one channel, and cells have three. Each
  /// pixel counts in the channel of its own filter only: no colour is interpolated, so light stays where it
  /// is. Red and blue have a quarter of the pixels. flood: of one channel.  fails: as make(); size_mismatch
  /// (more than one channel).
  static Result<CellWeights> of_mosaic(Grid cells, std::span<const CornerMap> corners, const Radiance& flood,
                                       const BayerPattern& filters, const WeightOptions& options = {},
                                       const Image<float>* shares = nullptr);

  /// Weights of a camera that has a pixel for each cell: pixel (i, j) sees what is at (i, j) + shift [cells].
  /// fails: limit (a shift of more than largest_shift).
  static Result<CellWeights> unmixing(Grid cells, int channels, Point shift);
  /// [cells] Beyond it, what is left of the shift costs more patterns than brute force takes.
  static constexpr double largest_shift = 0.12;

  Grid cells() const { return cells_; }
  Grid camera() const { return camera_; }
  /// Of the cells.
  int channels() const { return channels_; }
  /// Of photographs: 1 if the camera has a colour mosaic.
  int camera_channels() const { return of_mosaic_ ? 1 : channels_; }

  /// The photograph on the cells. A pixel that is not valid here, but in the flood-lit photograph, such as a
  /// clipped highlight, is taken for as bright as the others of its cell, each by its flood-lit light. A cell
  /// without a valid pixel is not valid. The variance is that of independent pixels, of light whose cell is
  /// uncertain, and of such pixels in a core or an area: by how much the others differ, and up to all
  /// flood-lit light. Neighbouring cells share pixels and their noise. With cores, superposition holds as far
  /// as the planes describe the light.
  /// fails: size_mismatch.
  Result<Radiance> gather(const Radiance& photograph) const;

  /// Divides all cells that the weights give by these values, one for each cell and above 0: the gain ratio.
  /// fails: size_mismatch, bad_value.
  Result<void> divide_by(const Image<float>& gain);
  /// Blurs photographs by a Gaussian of this variance along each axis [cells²], at most 1, before they are
  /// gathered.
  /// fails: bad_value.
  Result<void> blur_by(double variance);
  /// Subtracts this ghost from photographs before all else. corners: as in make(); for unmixing(), the
  /// shifted pixels.
  /// fails: as without_ghost().
  Result<void> subtract_ghost(std::span<const CornerMap> corners, const CameraGhost& ghost);
  /// The side of a camera pixel, root of the mean area [cells].
  double pixel_side() const { return pixel_side_; }
  /// Number of the weights, for comparison: CRC-32C of all of them.
  std::uint32_t digest() const;
  /// Cells that the camera sees.
  std::int64_t valid_cells() const;
  /// Valid cells without a core, which are weighted by area.
  std::int64_t cells_without_core() const { return without_core_; }
  /// The variance of a cell divided by that of a camera pixel of the same radiance, mean over the valid
  /// cells.
  double noise_share() const { return noise_share_; }

 private:
  /// The camera pixels of all cells: those of cell i are [first[i], first[i + 1]).
  struct Rows {
    std::vector<std::uint32_t> first, pixel;
  };
  /// One channel: cell = scale · Σ weight y / Σ weight reference.
  struct Channel {
    std::size_t rows = 0;               ///< index of its pixels
    std::vector<float> weight = {};     ///< of each pixel
    std::vector<float> reference = {};  ///< of each pixel: W, or 1
    std::vector<float> light = {};      ///< of each pixel: W; 0: not known
    std::vector<float> scale = {};      ///< of each cell; 0: the camera does not see it
    std::vector<float> unit = {};       ///< of each cell: 1 / gain ratio; 0: the camera does not see it
    std::vector<float> noise = {};      ///< variance of each cell, by that of these weights
    std::shared_ptr<const calibration::SharedPixels> shared = {};  ///< none: not by cores

    double noise_share(std::size_t cell, std::size_t begin, std::size_t end) const;
  };
  /// What the pixels of a cell that are not valid would add, by those that are.
  struct Missing {
    float light = 0;      ///< as Σ weight y
    float noise = 1;      ///< factor on Σ weight² variance
    float doubt = 0;      ///< variance, as Σ weight² variance
    float reference = 0;  ///< as Σ weight reference
  };

  CellWeights() = default;
  static Missing missing(const Channel& channel, std::size_t begin, std::size_t end,
                         std::span<const std::uint32_t> pixel, std::span<const float> mean,
                         std::span<const std::uint8_t> valid);
  Radiance gather_sharp(const Radiance& photograph) const;
  Radiance unmix(const Radiance& photograph) const;
  Radiance gather_plain(const Radiance& photograph) const;

  Grid cells_, camera_;
  int channels_ = 0;
  bool of_mosaic_ = false;
  std::vector<Rows> rows_;
  std::vector<Channel> channel_;
  std::int64_t without_core_ = 0;
  double noise_share_ = 1;
  std::optional<Point> shift_;  ///< of a camera with a pixel for each cell
  double pixel_side_ = 1;
  std::shared_ptr<const calibration::GhostSubtraction> ghost_ = {};  ///< none: no ghost
  double blur_ = 0;                                                  ///< rms width [pixels]
  float blurred_noise_ = 1;  ///< variance of a cell of a blurred photograph, by that of a sharp one

  friend class CellWeightsBuilder;
};

}  // namespace symrig
