// SPDX-License-Identifier: Apache-2.0
// The table of camera drivers. A new driver is a folder beside v4l2, and its function here (CONTRIBUTING.md).

#include "symrig/camera/internal/driver.hpp"
#include "symrig/image/internal/size_text.hpp"

#include <algorithm>
#include <array>
#include <iterator>

namespace symrig {
namespace camera {

// Each is in the driver's folder.
CameraDriver v4l2_driver();
CameraDriver genicam_driver();

std::span<const CameraDriver> camera_drivers() {
  static const std::array drivers{
      v4l2_driver(),
      genicam_driver(),
  };
  return drivers;
}

}  // namespace camera

std::vector<FoundCamera> find_cameras() {
  std::vector<FoundCamera> all;
  for (const camera::CameraDriver& driver : camera::camera_drivers()) {
    auto found = driver.find();
    std::move(found.begin(), found.end(), std::back_inserter(all));
  }
  return all;
}

Result<CameraInfo> look_at_camera(std::string_view wanted) {
  const auto drivers = camera::camera_drivers();
  const auto named = std::ranges::find_if(drivers, [wanted](const camera::CameraDriver& driver) {
    return !driver.prefix.empty() && wanted.starts_with(driver.prefix);
  });
  return (named == drivers.end() ? drivers.front() : *named).look(wanted);
}

std::string camera_path_forms() {
  std::string forms;
  for (const camera::CameraDriver& driver : camera::camera_drivers())
    forms += (forms.empty() ? "" : ", ") + std::string(driver.form);
  return forms;
}

}  // namespace symrig

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
