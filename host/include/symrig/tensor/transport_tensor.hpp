// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/block_tree.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace symrig {

namespace tensor {
struct Draft;
class LeafParts;
struct Store;
}  // namespace tensor

/// Leaf: T_IJ ≈ A Bᵀ, one pair (A, B) a channel.
/// A [|I| × rank]: on the camera's block I = [row_begin, row_end) in tree order; B [|J| × rank]: on the
/// projector's block J. rank 0 is an *empty* leaf (known to be below the noise). In a symmetric tensor a leaf
/// with I ≠ J stands for T_JI too. Leaves may overlap each other and everything else: T is their sum.
struct Leaf {
  std::int32_t row_begin = 0, row_end = 0;
  std::int32_t col_begin = 0, col_end = 0;
  std::int32_t rank = 0;
  std::int32_t level = 0;  ///< level of the block tree at which the node was accepted

  std::int32_t rows() const { return row_end - row_begin; }
  std::int32_t cols() const { return col_end - col_begin; }
  /// Factor columns of all channels, A and B.
  std::size_t columns(int channels) const {
    return 2 * static_cast<std::size_t>(std::int64_t{channels} * rank);
  }
  /// Their values.
  std::size_t values(int channels) const {
    return columns(channels) / 2 * static_cast<std::size_t>(std::int64_t{rows()} + cols());
  }
};

/// An *empty* leaf: two blocks of a level without light above the noise between them. It is stored so that
/// "known to be dark" differs from "not measured".
struct EmptyLeaf {
  std::int32_t row_block = 0, col_block = 0;  ///< indices into BlockTree::level(level)
};

/// One entry of T between two pixels (tree order). In a symmetric tensor it also stands for its mirror image.
struct ScalarLeaf {
  std::int32_t row = 0, col = 0;
};

/// Two pixels of a picture: (row, column) and (row + dy, column + dx).
struct BandOffset {
  int dy = 0, dx = 0;
};

/// Half of the offsets up to a radius, (dy > 0) or (dy = 0 and dx > 0), |dx|, |dy| ≤ radius, row by row:
/// 2 radius (radius + 1) of them. The other half are their mirror images.
std::vector<BandOffset> band_offsets(int radius);

/// A band leaf of a symmetric tensor: light from a pixel to its near neighbours (defocus, point spread). T[i,
/// i + d] = T[i + d, i] = values[(channel · offsets + k) · pixels + i], i in raster order, d =
/// band_offsets(radius)[k]; 0 where i + d is off the grid.
struct BandLeaf {
  int radius = 0;
  std::vector<float> values;
};

/// A measured column: T[row, j] = value for every projector pixel j in [col_begin, col_end). Brute force and
/// dual photography make them. A column wider than a pixel is a coarse measurement, spread evenly.
struct SparseColumn {
  std::int32_t col_begin = 0, col_end = 0;
  std::int64_t first = 0, last = 0;  ///< its entries: [first, last) of column_rows / column_values
};

/// Counts of one level, as in [Garg06 Fig. 9].
struct LeafCounts {
  std::int64_t rank1 = 0, low_rank = 0, empty = 0, scalar = 0;
};

/// photograph = T · pattern, with T held as a hierarchical tensor [Garg06 §5.1]: low-rank leaves + a sparse
/// part.
///
/// T is [camera pixels × projector pixels]. On a coaxial rig both grids are the same and T = Tᵀ:
/// `symmetric()` is true and only one half is stored. A tensor made from plain photographs (camera ≠
/// projector grid) is not symmetric and holds all of T. T is the sum of all stored parts, which may overlap.
///
/// A finished tensor holds factors, bands and off-diagonal entries as 16-bit floats with separate powers of
/// two. The diagonal and measured columns are 32-bit floats. Rounding changes an entry by at most 2⁻¹⁰ (1 +
/// 2⁻¹²) Σ|A||B|ᵀ + 2⁻³¹ Σ max|A| max|B| over its leaves (sums over ranks). A single entry or an entry of a
/// band changes by at most 2⁻¹¹ of itself + 2⁻³⁹ of the largest. Immutable after `TensorBuilder::finish`;
/// copies share one store. Thread-safe for reading.
class TransportTensor final : public TransportOperator {
 public:
  TransportTensor() = default;

  Grid camera_grid() const override { return camera_.grid(); }
  Grid projector_grid() const override { return symmetric_ ? camera_.grid() : projector_.grid(); }
  int channels() const override { return channels_; }
  bool symmetric() const { return symmetric_; }
  const BlockTree& camera_tree() const { return camera_; }
  const BlockTree& projector_tree() const { return symmetric_ ? camera_ : projector_; }

  /// photograph = T · pattern.  shapes: projector grid (1 channel) → camera grid (channels()).
  /// units: pattern 0..1 → radiance per unit of projector light.
  /// error: the rounding of T (above) + float sums, ≤ (|J| + leaves on the pixel's path + 4) ε ·
  /// Σ_leaf |A||B|ᵀ|pattern| per pixel, ε = 2⁻²⁴. The same bits for any number of threads.  fails:
  /// size_mismatch.  source: [Garg06 §5.1]
  Result<Image<float>> apply(const Image<float>& pattern) const override;

  /// The same for a pattern in memory of the caller: projector_grid().size() values, raster order.
  Result<Image<float>> apply_values(std::span<const float> pattern) const;

  Result<std::vector<Image<float>>> apply_batch(std::span<const Image<float>> patterns) const override;
  /// As apply_adjoint().
  Result<Image<float>> adjoint(const Image<float>& picture) const override;

  /// dual picture = Tᵀ · light: the scene as the projector sees it, lit from the camera.  shapes: camera grid
  /// (1 channel) → projector grid (channels()).  Same error and failures as apply.  source: [Sen05 §3]
  Result<Image<float>> apply_transposed(const Image<float>& light) const;

  /// The tensor as it was when the acquisition had reached `level`: deeper leaves are replaced by the rank-1
  /// estimate of their ancestor at that level, c r'/s with c = T_IJ 1, r = T_JI 1, s = Σc.  Needs
  /// symmetric().  source: [Garg06 §5.2, Fig. 11]
  Result<TransportTensor> stopped_at(int level) const;

  /// One entry for each level 0..levels-1 of the deeper of the two trees. A scalar leaf counts at the level
  /// at which it was accepted.
  std::vector<LeafCounts> leaves_per_level() const;
  /// The level of the leaf that holds each entry of the same slice of T [Garg06 Fig. 2d]. shapes: [cols ×
  /// cols]; -1 where nothing is stored. For symmetric tensors.
  Result<Image<float>> level_map(int camera_row) const;
  /// A slice of T: its rows and columns are the pixels of one camera row [Garg06 Fig. 2c]. camera_row in [0,
  /// rows). shapes: [cols × cols] of one channel. For symmetric tensors.
  Result<Image<float>> slice(int camera_row, int channel) const;
  /// Bytes of factors, values and index in memory.
  std::int64_t bytes() const;
  /// Bytes of T as a dense float matrix, all channels.
  double dense_bytes() const;

  std::span<const Leaf> leaves() const&;
  std::span<const Leaf> leaves() const&& = delete;  // it would outlive its tensor
  /// True unless the factors are read from a file each time that they are needed.
  bool in_memory() const;
  /// Calls use(leaf, factors) for each leaf in order. The unpacked factors: for each channel A [rows × rank],
  /// then B [cols × rank], column by column.
  using UseLeaf = std::function<void(const Leaf& leaf, std::span<const float> factors)>;
  Result<void> visit_leaves(const UseLeaf& use) const;
  /// The factors of all leaves, one after the other.
  Result<std::vector<float>> factors() const;
  std::vector<EmptyLeaf> empties(int level) const;  ///< sorted by row block, then column block
  std::int64_t empty_count(int level) const;
  std::vector<ScalarLeaf> scalars() const;   ///< the diagonal first; row ≥ col when symmetric
  std::vector<float> scalar_values() const;  ///< [scalar * channels() + channel]
  std::int64_t scalar_count() const;
  std::vector<BandLeaf> bands() const;
  std::span<const SparseColumn> columns() const;
  std::span<const std::int32_t> column_rows() const;  ///< camera pixel (tree order) of each entry
  std::span<const float> column_values() const;       ///< [entry * channels() + channel]
  int levels() const;                                 ///< of the deeper tree

  /// The level at which a scalar's two blocks are single pixels.
  int scalar_level(const ScalarLeaf& scalar) const;

  /// y += T p (or Tᵀ p) in tree order.  p: projector pixels, y: camera pixels (swapped when transposed), one
  /// channel.  fails: io, bad_format, bad_value (a tensor that is not in memory).
  Result<void> add_tree(std::span<const float> p, std::span<float> y, int channel, bool transposed) const;
  /// The same for a tensor in memory, which does not fail.
  void apply_tree(std::span<const float> p, std::span<float> y, int channel, bool transposed) const;

 private:
  friend class TensorBuilder;

  const tensor::Store& store() const;
  bool listed(const ScalarLeaf& scalar) const;
  Result<Image<float>> apply_between(std::span<const float> light, const BlockTree& from, const BlockTree& to,
                                     bool transposed) const;
  Result<std::vector<std::pair<std::int32_t, int>>> row_pixels(int camera_row) const;

  BlockTree camera_, projector_;  // projector_ is empty when symmetric_
  bool symmetric_ = true;
  int channels_ = 1;
  std::shared_ptr<const tensor::Draft> draft_;  // while it grows
  std::shared_ptr<const tensor::Store> store_;  // when it is finished
};

/// Builds a tensor leaf by leaf, and checks each leaf. Acquisition, fit and file loading use it.
class TensorBuilder {
 public:
  /// Symmetric tensor on one grid.
  TensorBuilder(BlockTree tree, int channels);
  /// General tensor.
  TensorBuilder(BlockTree camera, BlockTree projector, int channels);

  /// Adds a low-rank leaf, rank ≥ 1. factors: for each channel A [rows × rank] column-major, then B [cols ×
  /// rank]. In a symmetric tensor give each unordered pair of blocks once. A leaf with equal ranges must be
  /// symmetric itself; if each column of B is ± that of A, it needs half the space.
  void add_leaf(std::int32_t row_begin, std::int32_t row_end, std::int32_t col_begin, std::int32_t col_end,
                int rank, int level, std::span<const float> factors);
  /// From now on leaves are packed part by part, and their floats are forgotten. There is no current() then.
  void pack_leaves();
  /// All leaves as a scene file has them, in place of add_leaf(). For load_scene(): their parts are private.
  void take_leaves(std::vector<Leaf> leaves, tensor::LeafParts parts);
  /// Adds an empty leaf between two blocks of a level (their indices in it).
  void add_empty(int level, std::int32_t row_block, std::int32_t col_block);
  /// Adds one scalar: T[row, col] = values[channel], both in tree order. In a symmetric tensor it stands for
  /// T[col, row] too.
  void add_scalar(std::int32_t row, std::int32_t col, std::span<const float> values);
  /// Adds a band (symmetric tensors only, radius ≥ 1): values as in BandLeaf, added to all other leaves.
  void add_band(int radius, std::span<const float> values);
  /// Adds a measured column (general tensors only): T[rows[k], j] = values[k * channels + channel] for j in
  /// [col_begin, col_end).
  void add_column(std::int32_t col_begin, std::int32_t col_end, std::span<const std::int32_t> rows,
                  std::span<const float> values);

  /// The tensor so far, in floats. It is slower to apply than a finished one, and has no valid bytes().
  const TransportTensor& current() const { return tensor_; }
  /// Rounds and packs the tensor.
  TransportTensor finish() &&;

 private:
  std::shared_ptr<tensor::Draft> draft_;
  TransportTensor tensor_;
};

/// light = Σ_c T_cᵀ y_c, so that ⟨T x, y⟩ = ⟨x, Tᵀ y⟩ over all channels.  shapes: camera grid (the tensor's
/// channels) → projector grid (1 channel).  error: as TransportTensor::apply.  fails: size_mismatch.
Result<Image<float>> apply_adjoint(const TransportTensor& tensor, const Image<float>& picture);

/// Where stopped_capture() puts the unknown light inside a block.
enum class WithinBlocks : std::uint8_t {
  direct,   ///< all on the diagonal: every pixel keeps its light
  product,  ///< spread over the block as a rank-1 product, as between two blocks
};

/// Estimates from a finished tensor what a capture would hold if it had stopped after `level`. Pairs of
/// blocks that were split further become a product of the light that the two blocks see of each other. A
/// block with itself becomes `within`. Level 0 uses the flood-lit photograph alone. A leaf that was merged
/// from several counts as split further. Needs symmetric().  fails: as TransportTensor::visit_leaves.
Result<TransportTensor> stopped_capture(const TransportTensor& tensor, int level, WithinBlocks within);

}  // namespace symrig
