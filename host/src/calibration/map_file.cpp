// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/map_file.hpp"

#include "symrig/image/file.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {

Image<float> map_picture(const PixelMap& map) {
  Image<float> picture(map.camera, 3);
  std::ranges::copy(map.col.values(), picture.plane(0).begin());
  std::ranges::copy(map.row.values(), picture.plane(1).begin());
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
      if (!(col >= 0 && col <= static_cast<float>(projector.cols - 1) && row >= 0 &&
            row <= static_cast<float>(projector.rows - 1)))
        return Error{ErrorCode::bad_value,
                     fmt::format("{}: pixel ({}, {}) looks at row {:g}, column {:g} of a projector of {}",
                                 name, r, c, row, col, to_string(projector)),
                     "the map is of another projector: calibrate again"};
      map.col.at(r, c) = col, map.row.at(r, c) = row, map.mask.at(r, c) = 1;
    }
  return map;
}

Result<PixelMap> read_pixel_map(const std::filesystem::path& path, Grid projector) {
  SYMRIG_TRY(const Image<float> picture, read_image(path));
  return map_of_picture(picture, projector, path.string());
}

}  // namespace symrig
