// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/fitted_maps.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

/// [cells] Of the map. A core would have to keep 0.3 cells from each border, so only its middle would be
/// left.
constexpr double kLargestError = 0.1;

}  // namespace

Result<void> fit_maps(std::span<const Radiance> photographs, Registration& found) {
  SYMRIG_TRY(std::vector<CameraLook> looks, fit_camera_maps(found.cells, photographs));
  found.maps.clear();
  found.shares = Image<float>(found.camera(), 2 * static_cast<int>(looks.size()));
  for (CameraLook& look : looks) {
    for (int axis = 0; axis < 2; ++axis)
      std::ranges::copy(look.shares.plane(axis),
                        found.shares.plane(2 * static_cast<int>(found.maps.size()) + axis).begin());
    found.maps.push_back(std::move(look.map));
  }
  return {};
}

Result<void> check_maps(const Registration& found, const RegistrationOptions& options) {
  if (!(found.error() <= kLargestError))
    return Error{
        ErrorCode::bad_value,
        fmt::format("the stripes give a map with an error of {:.2f} cells, and {:.1f} is the most that helps",
                    found.error(), kLargestError),
        "focus camera and projector, expose longer, or look for mirrors in the scene"};
  double width = 0;
  for (const CameraMap& map : found.maps) width = std::max(width, map.edge_width());
  if (width > options.widest_edge)
    return Error{
        ErrorCode::bad_value,
        fmt::format("the borders of cells are blurred over {:.1f} cells, and {:.1f} is the most that helps",
                    width, options.widest_edge),
        "focus camera and projector, or make the cells larger"};
  const double pixels = found.pixels_per_cell();
  if (pixels < options.least_pixels)
    return Error{ErrorCode::limit,
                 fmt::format("the camera has {:.2f} pixels along the side of a cell, and {:.1f} are needed",
                             pixels, options.least_pixels),
                 fmt::format("make the cells {:.1f} times as large, or move the camera closer",
                             std::ceil(10 * options.least_pixels / pixels) / 10)};
  return {};
}

}  // namespace symrig::calibration
