// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/block_tree.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// A few directions of light that rows of T are made of: the columns of an orthonormal matrix over a block of
/// the cells.
struct LightBasis {
  std::int32_t begin = 0, end = 0;  ///< the block, in tree order
  std::int32_t rank = 0;
  std::int32_t first = 0;  ///< number of its first column among all of them

  std::int64_t values() const { return std::int64_t{end - begin} * rank; }
};

/// T on the camera's own pixels: photograph = T · pattern, with more pixels in the photograph than cells in
/// the pattern.
///
/// The row of pixel i in cell c is Σ_k a_ik v_k. The v_k are the same for all pixels that belong to cell c:
/// it is the one that they look at, or one beside it that is more like them. They are columns of the bases of
/// the leaves of T that hold row c, and single cells. The pixels of a cell are much alike but for their
/// brightness, so a_ik = brightness_i · (middle_k + step_k · code_ik), with codes of 8 bits. Thread-safe for
/// reading.
class CameraTransport final : public TransportOperator {
 public:
  /// Number of a column: k ≥ 0 is column k of the bases, −1 − n is cell n (raster order).
  using Column = std::int32_t;

  /// Pixels that belong to one cell, in one channel. Groups lie one after the other in the arrays of Parts.
  struct Group {
    std::int32_t channel = 0, columns = 0, pixels = 0;
  };

  /// As scene.h5 has them (docs/file-format.md).
  struct Parts {
    BlockTree cells;
    Grid camera;
    int channels = 1;
    std::string mosaic;  ///< the filters of a camera whose pixels have one colour each, such as "RGGB"; or ""
    std::string registration;  ///< which one says where the pixels look (CellWeights::digest, in hex); or ""
    std::vector<LightBasis> bases;            ///< of all channels
    std::vector<std::uint16_t> basis_values;  ///< halves; of each basis [rank × (end − begin)]
    std::vector<Group> groups;
    std::vector<Column> columns;                ///< of each group
    std::vector<std::uint16_t> middles, steps;  ///< halves; of each column of each group
    std::vector<std::int32_t> pixels;           ///< of each group: raster order of the camera
    std::vector<float> brightness;              ///< of each pixel
    std::vector<std::int8_t> codes;             ///< of each group [pixels × columns]
    /// Halves, of each pixel: mean of (photograph − row · pattern)² / variance over photographs that the fit
    /// did not see. 1: only noise is left; 0: no photograph says it. Empty: not known.
    std::vector<std::uint16_t> chi_square = {};
  };

  /// No coefficient, and no value that a sum over a pattern multiplies, is as large as this.
  static constexpr float kLargest = 0x1p60F;

  CameraTransport() = default;
  /// fails: bad_value (numbers that do not fit together; says which).
  static Result<CameraTransport> make(Parts parts);

  Grid projector_grid() const override { return parts_.cells.grid(); }
  Grid camera_grid() const override { return parts_.camera; }
  int channels() const override { return parts_.channels; }
  const Parts& parts() const { return parts_; }
  /// Bytes of all parts in memory.
  std::int64_t bytes() const;
  /// Pixels that have a row, and their coefficients; each channel of a pixel counts.
  std::int64_t rows() const { return std::ssize(parts_.pixels); }
  std::int64_t coefficients() const { return std::ssize(parts_.codes); }
  /// Parts::chi_square as a picture; 0 where it is not known. Empty if it is not known at all.
  Image<float> chi_square() const;
  /// values: one for each row, in the order of Parts::pixels.
  void set_chi_square(std::span<const float> values);

  /// 0 in pixels that have no row. error: half a step of each coefficient.
  Result<Image<float>> apply(const Image<float>& pattern) const override;
  Result<std::vector<Image<float>>> apply_batch(std::span<const Image<float>> patterns) const override;
  Result<Image<float>> adjoint(const Image<float>& picture) const override;

 private:
  /// Where the parts of a group begin.
  struct Place {
    std::int64_t column = 0, pixel = 0, code = 0;
  };
  Result<void> check_light(const Image<float>& pattern) const;
  template <int Lights>
  void apply_to(const Image<float>* patterns, int count, Image<float>* photographs) const;
  template <int Lights>
  std::vector<float> shown(const Image<float>* patterns, int count) const;

  Parts parts_;
  std::vector<Place> places_;              // of the groups
  std::vector<std::int64_t> basis_first_;  // of the bases, in basis_values
};

/// The rows of the pixels of one cell, as CameraTransport has them.
struct PackedRows {
  std::vector<CameraTransport::Column> columns;
  std::vector<std::uint16_t> middles, steps;  ///< halves, of each column
  std::vector<float> brightness;              ///< of each pixel
  std::vector<std::int8_t> codes;             ///< [pixels × columns]
};

/// Packs rows of coefficients [pixels × columns]. A column whose steps are too coarse for the pixels' light
/// is named twice: the second codes are what the first have left. A column that adds next to nothing to any
/// of the pixels is left out.
///
/// shown: the most that light shows to each column. light: of each pixel, flood-lit. error: of each
/// coefficient, times what is shown: about 1e-4 of the pixels' usual light, or less.
PackedRows pack_rows(std::span<const CameraTransport::Column> columns, std::span<const float> shown,
                     std::span<const float> rows, std::span<const float> light);

}  // namespace symrig
