// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"
#include "symrig/projector/projector.hpp"
#include "symrig/rig/frame_reading.hpp"

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace symrig {

/// Several projector-camera pairs that one board fires together [Garg06 Fig. 1]. The cells of the pairs tile
/// one grid, as views do. A photograph is one pattern over all pairs, seen by all cameras.
struct PairLayout {
  ViewLayout layout;
  Grid cells;  ///< of all pairs together

  std::size_t count() const { return static_cast<std::size_t>(layout.count()); }
  /// The cells of a pair. Pairs count row by row from the top left one.
  Tile tile(std::size_t pair) const {
    return layout.tile(cells, {static_cast<int>(pair) / layout.cols, static_cast<int>(pair) % layout.cols});
  }
};

/// The layout of pairs with these cells.
/// fails: size_mismatch (they tile no grid), bad_argument (not one grid for each place of the layout).
Result<PairLayout> pair_layout(ViewLayout layout, std::span<const Grid> cells);

/// The part of a picture in one tile.
template <class T>
Image<T> cut(const Image<T>& whole, const Tile& tile);
/// Writes a part into its tile.
template <class T>
void paste(const Image<T>& part, const Tile& tile, Image<T>& whole);

/// The frames of one exposure, one of each camera, as one frame. Only read_pairs() reads it.
CameraFrame join_frames(std::vector<CameraFrame> parts);

/// The projectors of all pairs, as one. Each shows its part of a pattern. All are paced by the host, or all
/// by the trigger.
/// fails: bad_argument (their pacing differs, or one shows bit planes), size_mismatch (other cells than the
/// layout's). Errors of the projectors name their pair.
Result<std::unique_ptr<Projector>> join_projectors(std::vector<std::unique_ptr<Projector>> projectors,
                                                   const PairLayout& layout);

/// The cameras of all pairs, as one whose grid is that of all cells. Each delivers its own frames.
/// fails: bad_argument (their channels differ). Errors of the cameras name their pair.
Result<std::unique_ptr<Camera>> join_cameras(std::vector<std::unique_ptr<Camera>> cameras,
                                             const PairLayout& layout);

/// Converts photographs of a camera to the cells of its pair (a registration). Empty: its pixels are the
/// cells.
using ToCells = std::function<Result<Radiance>(const Radiance& photograph)>;

/// Reads the frames of join_frames(): each part with `each`, its own camera and its own registration.
/// to_cells: one for each pair, or none at all.
std::shared_ptr<const FrameReading> read_pairs(std::shared_ptr<const FrameReading> each,
                                               const PairLayout& layout, std::vector<ToCells> to_cells = {});

template <class T>
Image<T> cut(const Image<T>& whole, const Tile& tile) {
  Image<T> part(tile.grid, whole.channels());
  for (int c = 0; c < whole.channels(); ++c)
    for (int row = 0; row < tile.grid.rows; ++row)
      for (int col = 0; col < tile.grid.cols; ++col)
        part.at(row, col, c) = whole.at(tile.row + row, tile.col + col, c);
  return part;
}

template <class T>
void paste(const Image<T>& part, const Tile& tile, Image<T>& whole) {
  for (int c = 0; c < part.channels(); ++c)
    for (int row = 0; row < tile.grid.rows; ++row)
      for (int col = 0; col < tile.grid.cols; ++col)
        whole.at(tile.row + row, tile.col + col, c) = part.at(row, col, c);
}

}  // namespace symrig
