// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/registration_steps.hpp"

#include "calibration/camera_optics/combs.hpp"
#include "calibration/cells/ghost_subtraction.hpp"

#include <algorithm>
#include <cmath>
#include <span>
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

namespace {

/// Pixels beyond the cells see little but the ghost: they tell where that is, not where they look. The ghost
/// is known to some hundredths, so half of a pixel's light of its own is enough. flood: with the ghost;
/// plain: without.
void leave_out_ghosts(const Radiance& flood, const Radiance& plain, std::vector<Radiance>& photographs) {
  constexpr float kOwnLight = 0.5F;
  for (std::size_t i = 0; i < flood.mean.values().size(); ++i) {
    if (plain.mean.values()[i] > kOwnLight * flood.mean.values()[i]) continue;
    for (Radiance& one : photographs)
      one.mean.values()[i] = 0, one.variance.values()[i] = 0, one.valid.values()[i] = 0;
  }
}

}  // namespace

Result<void> add_ghost(const GhostPlace& where, std::span<std::vector<Radiance>> photographs,
                       const std::function<Result<void>()>& fit, const Progress& progress,
                       Registration& found) {
  const std::vector<CornerMap> corners = where.known.corners();
  SYMRIG_TRY(const CellWeights by_area, CellWeights::make(where.known.cells, corners, where.known.flood,
                                                          {.weighting = Weighting::area}));
  SYMRIG_TRY(found.ghost, measure_ghost(where.rig, by_area, corners, progress));
  if (!found.ghost.found) return {};
  // At the border, the first map follows the ghost, and so does a little of the second. So two maps without
  // the pixels that see it come first.
  for (const bool subtracted : {false, false, true}) {
    SYMRIG_TRY(const auto subtract,
               GhostSubtraction::make(found.corners(), found.ghost.share, found.ghost.place));
    const Radiance plain = subtract(found.flood);
    for (std::vector<Radiance>& of_light : photographs) {
      if (subtracted)
        for (Radiance& one : of_light) one = subtract(one);
      leave_out_ghosts(found.flood, plain, of_light);
    }
    SYMRIG_CHECK(fit());
  }
  return {};
}

namespace {

/// [cells] Of edge_blur(). From here on, or from kLeastPixels, both blurs are measured: it is what edges show
/// of a blur of 0.09, if pixels are small.
constexpr double kLeastBlur = 0.02;
constexpr double kLeastBlurOfViews = 0.2;
/// [pixels] Edges that lie on the borders of pixels, in whole rows of them, show as much without any blur.
constexpr double kLeastPixels = 0.13;
/// Of OpticsBlur::far. A blur of 0.2 cells gives less than 0.02, and indirect light in sharp grooves 0.01.
/// Scattering below the surface gives 0.1 and more, and leaves edges sharp.
constexpr double kScattered = 0.05;
/// Edges show a blur of 0.2 cells and more to a tenth. A smaller one gives next to no far light.
constexpr double kEdgesMiss = 1.5;

/// Photographs on the camera's grid, without the ghost of the registration.
Result<std::vector<Radiance>> without_its_ghost(const Registration& found, std::span<const CornerMap> corners,
                                                std::span<const Radiance> photographs) {
  std::vector<Radiance> plain;
  plain.reserve(photographs.size());
  for (const Radiance& one : photographs) {
    SYMRIG_TRY(Radiance without, found.ghost.found ? without_ghost(one, corners, found.ghost) : Result(one));
    plain.push_back(std::move(without));
  }
  return plain;
}

/// Fits both blurs to the camera's pixels.
Result<OpticsBlur> blur_of_pixels(const CombPhotographs& combs, const Registration& found) {
  const std::vector<CornerMap> corners = found.corners();
  SYMRIG_TRY(const auto flood, without_its_ghost(found, corners, {&found.flood, 1}));
  CombPhotographs plain;
  SYMRIG_TRY(plain.rows, without_its_ghost(found, corners, combs.rows));
  SYMRIG_TRY(plain.columns, without_its_ghost(found, corners, combs.columns));
  return fit_comb_blur({found.cells, corners, flood.front(), plain}, found.blur);
}

}  // namespace

Result<CellWeights> weights_without_ghost(Grid cells, const std::vector<CornerMap>& corners,
                                          const Radiance& flood, const CameraGhost& ghost,
                                          const WeightOptions& options, const Image<float>* shares) {
  if (!ghost.found) return CellWeights::make(cells, corners, flood, options, shares);
  SYMRIG_TRY(const Radiance plain, without_ghost(flood, corners, ghost));
  SYMRIG_TRY(CellWeights weights, CellWeights::make(cells, corners, plain, options, shares));
  SYMRIG_CHECK(weights.subtract_ghost(corners, ghost));
  return weights;
}

Result<Image<std::uint8_t>> seen_cells(const CellWeights& weights, const Radiance& flood) {
  SYMRIG_TRY(const Radiance cells, weights.gather(flood));
  Image<std::uint8_t> seen(weights.cells(), 1, std::uint8_t{1});
  for (int c = 0; c < cells.valid.channels(); ++c)
    for (std::size_t i = 0; i < seen.values().size(); ++i) seen.values()[i] &= cells.valid.plane(c)[i];
  return seen;
}

bool is_blurred(const Registration& found, bool several_views) {
  const double least = std::max(kLeastBlur, kLeastPixels / found.pixels_per_cell());
  return found.edge_blur() > (several_views ? kLeastBlurOfViews : least);
}

Result<void> add_blur(const CombPhotographs& combs, Registration& found) {
  std::vector<CornerMap> corners = found.corners();
  const WeightOptions by_area{.weighting = Weighting::area};
  SYMRIG_TRY(const CellWeights weights,
             weights_without_ghost(found.cells, corners, found.flood, found.ghost, by_area, nullptr));
  for (CornerMap& map : corners)
    for (double& v : map.values()) v *= 2;
  CameraGhost ghost = found.ghost;
  ghost.place = {2 * ghost.place.row, 2 * ghost.place.col};
  SYMRIG_TRY(const CellWeights halves, weights_without_ghost({2 * found.cells.rows, 2 * found.cells.cols},
                                                             corners, found.flood, ghost, by_area, nullptr));
  SYMRIG_TRY(const Radiance flood, halves.gather(found.flood));
  SYMRIG_TRY(const Image<std::uint8_t> seen, seen_cells(weights, found.flood));
  SYMRIG_TRY(found.blur, measure_blur(combs, {weights, halves, flood.mean, seen}));
  // Light that scatters below the surface gets to the next cell too, but farther, and it leaves edges sharp.
  if (found.blur.far > kScattered + OpticsBlur::far_light(kEdgesMiss * found.edge_blur()))
    found.blur = OpticsBlur{.far = found.blur.far};
  if (found.blur.measured) {
    SYMRIG_TRY(found.blur, blur_of_pixels(combs, found));
  }
  return {};
}

}  // namespace symrig::calibration
