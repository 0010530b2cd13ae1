// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/transport_operator.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace symrig {
namespace {

Result<void> check(const TransportOperator& tensor, const ViewRelight& what) {
  for (const Grid grid : {tensor.projector_grid(), tensor.camera_grid()})
    if (!what.views.fits(grid))
      return Error{ErrorCode::bad_argument,
                   "views " + to_string(what.views) + " do not tile a grid of " + to_string(grid),
                   "give the rows x columns of views that the scene was captured with"};
  for (const auto& view : {what.from, what.to})
    if (view && !what.views.has(*view))
      return Error{ErrorCode::bad_argument,
                   "there is no view " + std::to_string(view->row) + "," + std::to_string(view->col) +
                       " among " + to_string(what.views),
                   "rows are 0 to " + std::to_string(what.views.rows - 1) + ", columns 0 to " +
                       std::to_string(what.views.cols - 1)};
  return {};
}

/// The picture of one tile on a dark grid.
Image<float> pasted(const Image<float>& picture, Grid grid, const Tile& tile) {
  Image<float> whole(grid);
  for (int row = 0; row < tile.grid.rows; ++row)
    for (int col = 0; col < tile.grid.cols; ++col)
      whole.at(tile.row + row, tile.col + col) = picture.at(row, col);
  return whole;
}

Image<float> cut_out(const Image<float>& whole, const Tile& tile) {
  Image<float> picture(tile.grid, whole.channels());
  for (int channel = 0; channel < whole.channels(); ++channel)
    for (int row = 0; row < tile.grid.rows; ++row)
      for (int col = 0; col < tile.grid.cols; ++col)
        picture.at(row, col, channel) = whole.at(tile.row + row, tile.col + col, channel);
  return picture;
}

Result<void> check_view_light(const Image<float>& light, Grid grid) {
  if (light.grid() == grid && light.channels() == 1) return {};
  return Error{ErrorCode::size_mismatch,
               "light is " + to_string(light.grid()) + " with " + std::to_string(light.channels()) +
                   " channels, this relighting needs " + to_string(grid) + " with 1",
               "resize the picture to " + to_string(grid) + " (rows x columns)"};
}

/// The light on the projector of all views; those that do not shine are dark.
Image<float> on_projector(const Image<float>& light, const TransportOperator& tensor,
                          const ViewRelight& what) {
  const Grid whole = tensor.projector_grid();
  return what.from ? pasted(light, whole, what.views.tile(whole, *what.from)) : light;
}

/// The part of the photograph that is asked for.
Image<float> seen(Image<float> photograph, const TransportOperator& tensor, const ViewRelight& what) {
  if (!what.to) return photograph;
  return cut_out(photograph, what.views.tile(tensor.camera_grid(), *what.to));
}

}  // namespace

Result<Grid> light_grid(const TransportOperator& tensor, const ViewRelight& what) {
  SYMRIG_CHECK(check(tensor, what));
  const Grid whole = tensor.projector_grid();
  return what.from ? what.views.tile(whole, *what.from).grid : whole;
}

Result<Grid> picture_grid(const TransportOperator& tensor, const ViewRelight& what) {
  SYMRIG_CHECK(check(tensor, what));
  const Grid whole = tensor.camera_grid();
  return what.to ? what.views.tile(whole, *what.to).grid : whole;
}

Result<Image<float>> relight(const TransportOperator& tensor, const Image<float>& light,
                             const ViewRelight& what) {
  SYMRIG_TRY(const Grid grid, light_grid(tensor, what));
  SYMRIG_CHECK(check_view_light(light, grid));
  SYMRIG_TRY(Image<float> photograph, tensor.apply(on_projector(light, tensor, what)));
  return seen(std::move(photograph), tensor, what);
}

Result<std::vector<Image<float>>> relight_batch(const TransportOperator& tensor,
                                                std::span<const Image<float>> lights,
                                                const ViewRelight& what) {
  SYMRIG_TRY(const Grid grid, light_grid(tensor, what));
  for (const Image<float>& light : lights) SYMRIG_CHECK(check_view_light(light, grid));
  // All views shine and see: nothing is cut, so nothing is copied.
  if (!what.from && !what.to) return tensor.apply_batch(lights);
  std::vector<Image<float>> patterns;
  patterns.reserve(lights.size());
  for (const Image<float>& light : lights) patterns.push_back(on_projector(light, tensor, what));
  SYMRIG_TRY(std::vector<Image<float>> photographs, tensor.apply_batch(patterns));
  for (Image<float>& photograph : photographs) photograph = seen(std::move(photograph), tensor, what);
  return photographs;
}

}  // namespace symrig
