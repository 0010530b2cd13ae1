// SPDX-License-Identifier: Apache-2.0
#include "calibration/map_pieces.hpp"

#include <array>
#include <vector>

namespace symrig::calibration {
namespace {

using BlockList = std::vector<std::array<int, 2>>;

/// Appends the neighbours that `number` calls `wanted`, and gives them the number `as`.
void grow(Image<int>& number, BlockList& piece, std::size_t from, int wanted, int as) {
  constexpr std::array<std::array<int, 2>, 4> kSteps4{{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};
  const Grid grid = number.grid();
  for (const auto& [down, right] : kSteps4) {
    const int r = piece[from][0] + down, c = piece[from][1] + right;
    if (r < 0 || c < 0 || r >= grid.rows || c >= grid.cols || number.at(r, c) != wanted) continue;
    number.at(r, c) = as;
    piece.push_back({r, c});
  }
}

}  // namespace

MapPieces::MapPieces(const PositionBlocks& blocks, const Image<Around>& around)
    : number_(blocks.grid(), 1, kNone) {
  constexpr int kWaiting = -2;
  const Grid grid = blocks.grid();
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      if (blocks.at(row, col).decoded && around.at(row, col) != Around::edge) number_.at(row, col) = kWaiting;
  BlockList piece;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      if (number_.at(row, col) != kWaiting) continue;
      number_.at(row, col) = count_;
      piece.assign(1, {row, col});
      for (std::size_t next = 0; next < piece.size(); ++next) grow(number_, piece, next, kWaiting, count_);
      if (piece.size() >= kLeast) {
        ++count_;
        continue;
      }
      for (const auto& [r, c] : piece) number_.at(r, c) = kNone;
    }
}

}  // namespace symrig::calibration
