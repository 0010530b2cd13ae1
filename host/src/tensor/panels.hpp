// SPDX-License-Identifier: Apache-2.0
// The places of the factors in memory. Applying a tensor reads them as one stream.
#pragma once

#include "symrig/tensor/internal/half.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace symrig::tensor {

/// A factor column: one value for each pixel of [begin, end) in tree order.
struct Column {
  std::int32_t begin = 0, end = 0;
};

/// The columns of one chunk that share a range of pixels: a dense matrix [pixels × columns].
struct Panel {
  std::int32_t begin = 0;  ///< first pixel, relative to the chunk's first
  std::int32_t pixels = 0, columns = 0;

  /// Vector lanes are along the longer side (x < length()). The other side (k < count()) is cut into groups.
  bool along_pixels() const { return pixels >= columns; }
  std::size_t length() const { return static_cast<std::size_t>(std::max(pixels, columns)); }
  std::size_t count() const { return static_cast<std::size_t>(std::min(pixels, columns)); }
  std::size_t values() const { return length() * count(); }
};

inline constexpr std::size_t kTile = 16;  ///< neighbouring values of one line
inline constexpr std::size_t kGroup = 8;  ///< lines that are read together

/// The place of value x of line k in a panel of `length` × `count`. A panel has groups of 8 lines. A group
/// has tiles of 16 values; each tile contains the lines of the group one after the other. The last group and
/// the last tile are shorter, without padding.
inline std::size_t panel_offset(std::size_t length, std::size_t count, std::size_t x, std::size_t k) {
  const std::size_t group = k / kGroup * kGroup;
  const std::size_t lines = std::min(kGroup, count - group);
  const std::size_t tile = x / kTile * kTile;
  const std::size_t wide = std::min(kTile, length - tile);
  return group * length + tile * lines + (k - group) * wide + (x - tile);
}

/// Panels of at least one whole tile start at a multiple of the tile.
inline std::size_t panel_start(std::size_t at, std::size_t length) {
  return length < kTile ? at : (at + kTile - 1) / kTile * kTile;
}

/// Pixels of a chunk: p and y of one chunk need 32 KB together.
inline constexpr std::int32_t kChunkPixels = 4096;

/// Chunks of `pixels` pixels; chunk k begins at k · kChunkPixels.
inline std::size_t chunk_count(std::int64_t pixels) {
  return static_cast<std::size_t>((pixels + kChunkPixels - 1) / kChunkPixels);
}

/// The pixels of one task: small enough for the first cache, large enough to cut few columns.
struct Chunk {
  std::int32_t begin = 0, end = 0;          ///< pixels
  std::size_t first_panel = 0, panels = 0;  ///< its panels
  std::size_t first_piece = 0, pieces = 0;  ///< its pieces: the columns of its panels in their order
  std::size_t first_value = 0;              ///< its first half in the factor stream
};

/// Columns are cut into *pieces* at the borders of chunks. Pieces with the same range form a panel.
class Panels {
 public:
  Panels() = default;
  Panels(std::int64_t pixels, std::span<const Column> columns);

  std::span<const Chunk> chunks() const { return chunks_; }
  std::span<const Panel> panels(const Chunk& chunk) const {
    return std::span(panels_).subspan(chunk.first_panel, chunk.panels);
  }
  std::size_t columns() const { return columns_; }
  std::size_t pieces() const { return slots_.size(); }
  /// The number of sums: one for each column, then one for each piece of a column that was cut.
  std::size_t slots() const { return columns_ + column_of_part_.size(); }
  /// Halves in the stream of one channel.
  std::size_t values() const { return values_; }
  /// How many halves a kernel may read after the last one: one vector.
  static constexpr std::size_t kSlack = 32;

  /// sums[slot] = dots[piece] for the pieces of a chunk: every slot has one writer. Width: values a piece.
  template <std::size_t Width>
  void keep_dots(const Chunk& chunk, const float* dots, float* sums) const;
  /// sums[column] = its parts in the order of the chunks, for the columns that were cut.
  template <std::size_t Width>
  void add_parts(float* sums) const;
  /// weights[piece] = sums[column of the piece] for the pieces of a chunk.
  template <std::size_t Width>
  void fetch_weights(const Chunk& chunk, const float* sums, float* weights) const;

  /// visit(column, pixel, at): every stored value, `at` its place in the stream.
  template <class Visit>
  void for_values(const Visit& visit) const;

  /// The values of a column from a pixel on.
  using ColumnValues = std::function<const Half*(std::size_t column, std::int32_t pixel)>;
  /// Fills the stream of one channel, with all threads.
  void fill(const ColumnValues& values, Half* stream) const;

  std::int64_t bytes() const;

 private:
  void fill_chunk(const Chunk& chunk, const ColumnValues& values, Half* stream) const;
  std::size_t column_of(std::size_t slot) const {
    return slot < columns_ ? slot : column_of_part_[slot - columns_];
  }

  std::size_t columns_ = 0, values_ = 0;
  std::vector<Chunk> chunks_;
  std::vector<Panel> panels_;
  std::vector<std::uint32_t> slots_;           // of each piece
  std::vector<std::uint32_t> column_of_part_;  // of each piece of a cut column, its pieces side by side
};

template <std::size_t Width>
void Panels::keep_dots(const Chunk& chunk, const float* dots, float* sums) const {
  for (std::size_t k = 0; k < chunk.pieces; ++k)
    std::copy_n(dots + k * Width, Width, sums + slots_[chunk.first_piece + k] * Width);
}

template <std::size_t Width>
void Panels::add_parts(float* sums) const {
  for (const std::uint32_t column : column_of_part_) std::fill_n(sums + column * Width, Width, 0.0F);
  for (std::size_t part = 0; part < column_of_part_.size(); ++part)
    for (std::size_t lane = 0; lane < Width; ++lane)
      sums[column_of_part_[part] * Width + lane] += sums[(columns_ + part) * Width + lane];
}

template <std::size_t Width>
void Panels::fetch_weights(const Chunk& chunk, const float* sums, float* weights) const {
  for (std::size_t k = 0; k < chunk.pieces; ++k)
    std::copy_n(sums + column_of(slots_[chunk.first_piece + k]) * Width, Width, weights + k * Width);
}

template <class Visit>
void Panels::for_values(const Visit& visit) const {
  for (const Chunk& chunk : chunks_) {
    std::size_t start = chunk.first_value, piece = chunk.first_piece;
    for (const Panel& panel : panels(chunk)) {
      const std::size_t length = panel.length(), count = panel.count();
      start = panel_start(start, length);
      for (std::size_t c = 0; c < static_cast<std::size_t>(panel.columns); ++c, ++piece) {
        const std::size_t column = column_of(slots_[piece]);
        for (std::size_t i = 0; i < static_cast<std::size_t>(panel.pixels); ++i)
          visit(column, static_cast<std::size_t>(chunk.begin + panel.begin) + i,
                start + (panel.along_pixels() ? panel_offset(length, count, i, c)
                                              : panel_offset(length, count, c, i)));
      }
      start += panel.values();
    }
  }
}

}  // namespace symrig::tensor
