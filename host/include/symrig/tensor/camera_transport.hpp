// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// A few directions of light that rows of T are made of: the columns of an orthonormal matrix over a block of
/// the cells.
struct LightBasis {
  std::int32_t begin = 0, end = 0;  ///< the block, in tree order
  std::int32_t rank = 0;
  std::int32_t first = 0;  ///< number of its first column among all of them
};

/// T on the camera's own pixels: photograph = T · pattern, with more pixels in the photograph than cells in
/// the pattern.
///
/// The row of pixel i in cell c is Σ_k a_ik v_k. The v_k are the same for all pixels that look at cell c:
/// columns of the bases of the leaves of T that hold row c, and single cells. Thread-safe for reading.
class CameraTransport {
 public:
  /// Number of a column: k ≥ 0 is column k of the bases, −1 − n is cell n (raster order).
  using Column = std::int32_t;

  /// What the pixels of one cell have in common, of one channel.
  struct Group {
    std::int32_t channel = 0;
    std::int64_t first_column = 0, first_pixel = 0;  ///< in columns(), in pixels()
    std::int64_t first_value = 0;                    ///< in values(): pixels × columns, pixel by pixel
    std::int32_t columns = 0, pixels = 0;
  };

  struct Parts {
    BlockTree cells;
    Grid camera;
    int channels = 1;
    std::vector<LightBasis> bases;    ///< of all channels
    std::vector<float> basis_values;  ///< of each basis [(end − begin) × rank], column by column
    std::vector<Group> groups;
    std::vector<Column> columns;
    std::vector<std::int32_t> pixels;  ///< raster order of the camera
    std::vector<float> values;
  };

  CameraTransport() = default;
  /// fails: bad_value (numbers that do not fit together).
  static Result<CameraTransport> make(Parts parts);

  Grid projector_grid() const { return parts_.cells.grid(); }
  Grid camera_grid() const { return parts_.camera; }
  int channels() const { return parts_.channels; }
  const Parts& parts() const { return parts_; }

  /// shapes: projector grid (1 channel) → camera grid (channels()). 0 in pixels that have no row.
  /// fails: size_mismatch.
  Result<Image<float>> apply(const Image<float>& pattern) const;

 private:
  Parts parts_;
};

}  // namespace symrig
