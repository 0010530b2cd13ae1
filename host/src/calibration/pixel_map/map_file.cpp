// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace symrig {
namespace {

/// Instead of a coordinate that the map does not have. Picture files hold no NaN, and no position is
/// negative.
constexpr float kNone = -1;

/// The coordinates that a picture knows. The other one is kNone in every decoded pixel.
CodeAxes known_axes(const Image<float>& picture) {
  std::array<bool, 2> known{false, false};
  bool any = false;
  for (std::size_t i = 0; i < picture.plane(2).size(); ++i) {
    if (picture.plane(2)[i] != 1) continue;
    any = true;
    for (int axis = 0; axis < 2; ++axis) known[axis] = known[axis] || picture.plane(axis)[i] != kNone;
  }
  if (!any || known[0] == known[1]) return CodeAxes::both;
  return known[0] ? CodeAxes::columns : CodeAxes::rows;
}

bool on_axis(float position, int size) {
  return position >= 0 && position <= static_cast<float>(size - 1);
}

}  // namespace

Image<float> map_picture(const PixelMap& map) {
  Image<float> picture(map.camera, 3);
  const auto held = [](float position) { return std::isnan(position) ? kNone : position; };
  std::ranges::transform(map.col.values(), picture.plane(0).begin(), held);
  std::ranges::transform(map.row.values(), picture.plane(1).begin(), held);
  std::ranges::copy(map.mask.values(), picture.plane(2).begin());
  return picture;
}

Result<PixelMap> map_of_picture(const Image<float>& picture, Grid projector, const std::string& name) {
  if (picture.channels() != 3)
    return Error{ErrorCode::bad_format,
                 fmt::format("{}: has {} channels; a map has 3", name, picture.channels()),
                 "give a map of symrig calibrate -o"};
  PixelMap map;
  map.camera = picture.grid();
  map.projector = projector;
  map.axes = known_axes(picture);
  map.col = map.row = Image<float>(map.camera);
  map.mask = Image<std::uint8_t>(map.camera);
  for (int r = 0; r < map.camera.rows; ++r)
    for (int c = 0; c < map.camera.cols; ++c) {
      const float col = picture.at(r, c, 0), row = picture.at(r, c, 1), decoded = picture.at(r, c, 2);
      if (decoded != 0 && decoded != 1)
        return Error{ErrorCode::bad_format,
                     fmt::format("{}: pixel ({}, {}) has {:g} in the third channel, which must be 0 or 1",
                                 name, r, c, decoded),
                     "give a map of symrig calibrate -o"};
      if (decoded == 0) continue;
      if (!(map.axes == CodeAxes::rows || on_axis(col, projector.cols)) ||
          !(map.axes == CodeAxes::columns || on_axis(row, projector.rows)))
        return Error{ErrorCode::bad_value,
                     fmt::format("{}: pixel ({}, {}) looks at row {:g}, column {:g} of a projector of {}",
                                 name, r, c, row, col, to_string(projector)),
                     "the map is of another projector: calibrate again"};
      constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
      map.col.at(r, c) = map.axes == CodeAxes::rows ? kUnknown : col;
      map.row.at(r, c) = map.axes == CodeAxes::columns ? kUnknown : row;
      map.mask.at(r, c) = 1;
    }
  return map;
}

Result<PixelMap> read_pixel_map(const std::filesystem::path& path, Grid projector) {
  SYMRIG_TRY(const Image<float> picture, read_image(path));
  return map_of_picture(picture, projector, path.string());
}

}  // namespace symrig
