// SPDX-License-Identifier: Apache-2.0
// The parts of T beside the low-rank leaves: single entries (the diagonal, which holds the direct light, and
// others), bands, and leaves without light.
#pragma once

#include "symrig/tensor/internal/half.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::tensor {

/// The diagonal as floats, one for each pixel and channel, and which entries are stored. It holds most of the
/// light, so the rounding of 16-bit floats would be visible.
class Diagonal {
 public:
  Diagonal() = default;
  explicit Diagonal(std::int64_t pixels, int channels);

  void add(std::int32_t pixel, std::span<const float> values);
  bool empty() const { return stored_.empty(); }
  std::int64_t size() const;  ///< stored entries
  bool holds(std::int32_t pixel) const {
    return (stored_[static_cast<std::size_t>(pixel) / 8] >> (static_cast<unsigned>(pixel) % 8U) & 1U) != 0;
  }
  /// Values of one channel, tree order; 0 where nothing is stored.
  std::span<const float> values(int channel) const {
    return std::span(values_).subspan(static_cast<std::size_t>(channel) * pixels_, pixels_);
  }
  std::int64_t bytes() const {
    return static_cast<std::int64_t>(values_.size() * sizeof(float) + stored_.size());
  }

 private:
  std::size_t pixels_ = 0;
  std::vector<float> values_;         // [channel][pixel]
  std::vector<std::uint8_t> stored_;  // a bit a pixel
};

/// Entries sorted by the pixel that sees, so that each task adds only to its own pixels. They are halves with
/// one power of two for each channel, in squares of 256 × 256, so that two bytes give an entry's place.
/// error: ≤ 2⁻¹¹ |value| + 2⁻³⁹ max|value of the channel|.
class Entries {
 public:
  Entries() = default;
  /// values: [entry * channels + channel].
  Entries(std::span<const ScalarLeaf> at, std::span<const float> values, int channels);

  std::size_t size() const { return local_.size(); }
  ScalarLeaf at(std::size_t entry) const;
  float value(std::size_t entry, int channel) const;
  /// y += T p for the rows [begin, end), multiples of 256 or the last; y: the first of these rows, p: all
  /// columns. Width patterns interleaved.
  template <std::size_t Width>
  void apply(int channel, std::int32_t begin, std::int32_t end, const float* p, float* y) const;
  std::int64_t bytes() const;

 private:
  struct Square {
    std::int32_t row = 0, col = 0;  ///< its first row and column
    std::uint32_t first = 0;        ///< its first entry
  };
  struct Local {
    std::uint8_t row, col;
  };

  std::vector<Square> squares_;  // and one behind the last
  std::vector<Local> local_;
  std::vector<Half> values_;   // [channel][entry], and slack for the conversion
  std::vector<float> scales_;  // [channel]
};

/// A band leaf: one plane of halves for each offset, in raster order, without an index.
/// error: ≤ 2⁻¹¹ |value| + 2⁻³⁹ max|value of the plane|.
class Band {
 public:
  /// values: [channel][offset][raster pixel], offsets as band_offsets(radius) lists them.
  Band(Grid grid, int channels, int radius, std::span<const float> values);

  int radius() const { return radius_; }
  /// The given values, rounded.
  std::vector<float> values() const;
  /// y += T p on one row of the picture. Width patterns interleaved in p and y, raster order.
  template <std::size_t Width>
  void apply_row(int channel, int row, const float* p, float* y) const;
  std::int64_t bytes() const;

 private:
  std::size_t pixels() const { return static_cast<std::size_t>(grid_.size()); }

  Grid grid_;
  int radius_;
  std::vector<BandOffset> offsets_;
  std::vector<Half> halves_;   // [channel][offset][pixel], and slack for the kernels
  std::vector<float> scales_;  // [channel][offset]
};

/// The empty leaves of one level, sorted by row block, then column block. Each is stored as the distance from
/// the previous one in as few bytes as possible: 7 bits a byte, lowest first; the eighth bit means "more
/// bytes follow".
class EmptyList {
 public:
  EmptyList() = default;
  /// columns: column blocks of the level.
  EmptyList(std::vector<EmptyLeaf> leaves, std::int64_t columns);

  std::int64_t size() const { return size_; }
  std::vector<EmptyLeaf> leaves() const;
  std::int64_t bytes() const { return static_cast<std::int64_t>(steps_.size()); }

 private:
  std::int64_t size_ = 0, columns_ = 1;
  std::vector<std::uint8_t> steps_;
};

}  // namespace symrig::tensor
