// SPDX-License-Identifier: Apache-2.0
#include "camera/driver_parts.hpp"

#include "image/size_text.hpp"

#include <algorithm>

namespace symrig::camera {

using base::TableReader;
using base::TomlNode;

Image<std::uint8_t> dead_pixels(const Image<std::uint8_t>& defects, const Region& of) {
  if (std::ranges::none_of(defects.values(), [](std::uint8_t d) { return d != 0; })) return {};
  const Region region = resolved(defects.grid(), of);
  const int each = region.binning;
  Image<std::uint8_t> dead(Grid{region.size.rows / each, region.size.cols / each});
  const int reach = each > 1 ? 2 : 1;
  for (int row = 0; row < dead.grid().rows; ++row)
    for (int col = 0; col < dead.grid().cols; ++col) {
      const int top = region.row + row / reach * reach * each, left = region.col + col / reach * reach * each;
      for (int y = top; y < std::min(top + reach * each, defects.grid().rows); ++y)
        for (int x = left; x < std::min(left + reach * each, defects.grid().cols); ++x)
          if (defects.at(y, x) != 0) dead.at(row, col) = 1;
    }
  return dead;
}

void read_region(TableReader& table, Region& region) {
  const TomlNode* node = table.find("region");
  if (node == nullptr) return;
  TableReader keys(*node, table.path_of("region"), table.context());
  keys.read_whole("row", region.row, 0, image::kLargestSide);
  keys.read_whole("col", region.col, 0, image::kLargestSide);
  keys.require("rows", "the region's height in pixels of the picture");
  keys.require("cols", "the region's width in pixels of the picture");
  keys.read_whole("rows", region.size.rows, 1, image::kLargestSide);
  keys.read_whole("cols", region.size.cols, 1, image::kLargestSide);
  keys.finish();
}

}  // namespace symrig::camera
