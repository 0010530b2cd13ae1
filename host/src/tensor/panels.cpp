// SPDX-License-Identifier: Apache-2.0
#include "tensor/panels.hpp"

#include <tuple>

namespace symrig::tensor {
namespace {

/// Pixels of a chunk: p and y of one chunk need 32 KB together.
constexpr std::int32_t kChunkPixels = 4096;

struct Piece {
  std::int32_t chunk, begin, end;  // pixels of the whole grid
  std::uint32_t slot;
};

/// The pieces of all columns in the order of the stream. The slot of a column inside one chunk is its number.
/// The slots of all other pieces come after those of the columns.
std::vector<Piece> cut(std::span<const Column> columns, std::vector<std::uint32_t>& column_of_part) {
  std::vector<Piece> pieces;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const auto [begin, end] = columns[c];
    if (begin == end) continue;
    const std::int32_t first = begin / kChunkPixels, last = (end - 1) / kChunkPixels;
    for (std::int32_t chunk = first; chunk <= last; ++chunk) {
      auto slot = static_cast<std::uint32_t>(c);
      if (first != last) {
        slot = static_cast<std::uint32_t>(columns.size() + column_of_part.size());
        column_of_part.push_back(static_cast<std::uint32_t>(c));
      }
      pieces.push_back(
          {chunk, std::max(begin, chunk * kChunkPixels), std::min(end, (chunk + 1) * kChunkPixels), slot});
    }
  }
  std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
    return std::tie(a.chunk, a.begin, a.end, a.slot) < std::tie(b.chunk, b.begin, b.end, b.slot);
  });
  return pieces;
}

}  // namespace

Panels::Panels(std::int64_t pixels, std::span<const Column> columns) : columns_(columns.size()) {
  const std::vector<Piece> pieces = cut(columns, column_of_part_);
  column_of_part_.shrink_to_fit();
  slots_.reserve(pieces.size());
  auto piece = pieces.begin();
  for (std::int32_t begin = 0, number = 0; begin < pixels; begin += kChunkPixels, ++number) {
    values_ = (values_ + kTile - 1) / kTile * kTile;
    const auto end = static_cast<std::int32_t>(std::min<std::int64_t>(pixels, begin + kChunkPixels));
    Chunk chunk{begin, end, panels_.size(), 0, slots_.size(), 0, values_};
    while (piece != pieces.end() && piece->chunk == number) {
      Panel panel{piece->begin - begin, piece->end - piece->begin, 0};
      const auto same = [&](const Piece& p) {
        return p.begin == begin + panel.begin && p.end - p.begin == panel.pixels;
      };
      for (; piece != pieces.end() && same(*piece); ++piece, ++panel.columns) slots_.push_back(piece->slot);
      values_ = panel_start(values_, panel.length()) + panel.values();
      panels_.push_back(panel);
    }
    chunk.panels = panels_.size() - chunk.first_panel;
    chunk.pieces = slots_.size() - chunk.first_piece;
    chunks_.push_back(chunk);
  }
  panels_.shrink_to_fit();
}

std::int64_t Panels::bytes() const {
  const auto of = [](const auto& v) { return static_cast<std::int64_t>(v.size() * sizeof(v[0])); };
  return of(chunks_) + of(panels_) + of(slots_) + of(column_of_part_);
}

}  // namespace symrig::tensor
