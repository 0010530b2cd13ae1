// SPDX-License-Identifier: Apache-2.0
#include "tensor/panels.hpp"

#include <tuple>

#include <tbb/parallel_for.h>

namespace symrig::tensor {
namespace {

struct ColumnPiece {
  std::int32_t chunk, begin, end;  // pixels of the whole grid
  std::uint32_t slot;
};

/// The pieces of all columns in the order of the stream. The slot of a column inside one chunk is its number.
/// The slots of all other pieces come after those of the columns.
std::vector<ColumnPiece> cut(std::span<const Column> columns, std::vector<std::uint32_t>& column_of_part) {
  std::vector<ColumnPiece> pieces;
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
  std::sort(pieces.begin(), pieces.end(), [](const ColumnPiece& a, const ColumnPiece& b) {
    return std::tie(a.chunk, a.begin, a.end, a.slot) < std::tie(b.chunk, b.begin, b.end, b.slot);
  });
  return pieces;
}

/// Copies column c of a panel to its place. to: the panel's first value.
void put_piece(const Panel& panel, std::size_t c, const Half* from, Half* to) {
  const std::size_t length = panel.length(), count = panel.count();
  if (panel.along_pixels()) {
    const std::size_t group = c / kGroup * kGroup;
    const std::size_t lines = std::min(kGroup, count - group);
    to += group * length;
    for (std::size_t tile = 0; tile < length; tile += kTile) {
      const std::size_t wide = std::min(kTile, length - tile);
      std::copy_n(from + tile, wide, to + tile * lines + (c - group) * wide);
    }
    return;
  }
  const std::size_t tile = c / kTile * kTile;
  const std::size_t wide = std::min(kTile, length - tile);
  for (std::size_t group = 0; group < count; group += kGroup) {
    const std::size_t lines = std::min(kGroup, count - group);
    Half* const at = to + group * length + tile * lines + (c - tile);
    for (std::size_t k = 0; k < lines; ++k) at[k * wide] = from[group + k];
  }
}

}  // namespace

Panels::Panels(std::int64_t pixels, std::span<const Column> columns) : columns_(columns.size()) {
  const std::vector<ColumnPiece> pieces = cut(columns, column_of_part_);
  column_of_part_.shrink_to_fit();
  slots_.reserve(pieces.size());
  auto piece = pieces.begin();
  for (std::int32_t begin = 0, number = 0; begin < pixels; begin += kChunkPixels, ++number) {
    values_ = (values_ + kTile - 1) / kTile * kTile;
    const auto end = static_cast<std::int32_t>(std::min<std::int64_t>(pixels, begin + kChunkPixels));
    Chunk chunk{begin, end, panels_.size(), 0, slots_.size(), 0, values_};
    while (piece != pieces.end() && piece->chunk == number) {
      Panel panel{piece->begin - begin, piece->end - piece->begin, 0};
      const auto same = [&](const ColumnPiece& p) {
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

void Panels::fill(const ColumnValues& values, Half* stream) const {
  tbb::parallel_for(std::size_t{0}, chunks_.size(),
                    [&](std::size_t k) { fill_chunk(chunks_[k], values, stream); });
}

void Panels::fill_chunk(const Chunk& chunk, const ColumnValues& values, Half* stream) const {
  std::size_t start = chunk.first_value, piece = chunk.first_piece;
  for (const Panel& panel : panels(chunk)) {
    start = panel_start(start, panel.length());
    for (std::size_t c = 0; c < static_cast<std::size_t>(panel.columns); ++c, ++piece)
      put_piece(panel, c, values(column_of(slots_[piece]), chunk.begin + panel.begin), stream + start);
    start += panel.values();
  }
}

std::int64_t Panels::bytes() const {
  const auto of = [](const auto& v) { return static_cast<std::int64_t>(v.size() * sizeof(v[0])); };
  return of(chunks_) + of(panels_) + of(slots_) + of(column_of_part_);
}

}  // namespace symrig::tensor
