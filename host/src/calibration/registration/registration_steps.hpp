// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/calibration/registration.hpp"

#include <functional>
#include <span>
#include <vector>

namespace symrig::calibration {

/// Replaces the maps and shares of a registration by those that photographs of the Gray code tell.
/// needs: found.cells, found.flood. fails: as fit_camera_maps.
Result<void> fit_maps(std::span<const Radiance> photographs, Registration& found);

/// Whether the maps are good enough for a capture.
/// fails: bad_value (too uncertain, or out of focus); limit (fewer camera pixels than the cells need).
Result<void> check_maps(const Registration& found, const RegistrationOptions& options);

/// Where a ghost is looked for: a rig of one view, and what is known of its registration.
struct GhostPlace {
  Probe& rig;
  const Registration& known;
};

/// Looks for a ghost. Subtracts it from photographs of the Gray code, and fits the maps again.
/// photographs: each list belongs to one light, such as that of one view. fit: fits the maps of `found` to
/// them.
/// fails: as measure_ghost and fit.
Result<void> add_ghost(const GhostPlace& where, std::span<std::vector<Radiance>> photographs,
                       const std::function<Result<void>()>& fit, const Progress& progress,
                       Registration& found);

/// Whether the borders of cells are blurred in the picture. Then both blurs are measured.
/// several_views: light that other views exchange with a pixel widens its edges, by 0.14 to 0.15 cells if the
/// optics are sharp (views2 and views3, 32 and 48 cells).
bool is_blurred(const Registration& found, bool several_views);

/// Sets found.blur from combs of the rig, without its ghost. Light that scatters below the surface is told
/// from blur of the optics.
/// fails: as CellWeights::make, measure_blur and without_ghost.
Result<void> add_blur(const CombPhotographs& combs, Registration& found);

/// Weights of a registration on a grid of `cells`, without its ghost. corners, ghost: on that grid.
/// fails: as CellWeights::make and without_ghost.
Result<CellWeights> weights_without_ghost(Grid cells, const std::vector<CornerMap>& corners,
                                          const Radiance& flood, const CameraGhost& ghost,
                                          const WeightOptions& options, const Image<float>* shares);

/// 1 for the cells that the camera sees in all channels. A cell that one channel does not see would be lit
/// and not seen.
/// fails: as CellWeights::gather.
Result<Image<std::uint8_t>> seen_cells(const CellWeights& weights, const Radiance& flood);

/// Registers a camera with pixels of its own on a rig of several views. The map is one smooth map for the
/// whole picture, because camera and projector share their axis and so every mirror.
///
/// The Gray code is shown in one view after another. Which view a pixel belongs to is found first
/// (OwnViews::find), and again from the map. Photographs: for each view one, and one for each bit that
/// changes inside its tile; four of the flood-lit scene; 6 for a ghost; and 8 for the blurs of a picture that
/// is not sharp. Ghost and blurs are those of the view in the middle, by its own light: the light of other
/// views looks like both. They are taken to be the same in all views. A tile of fewer than 12 cells along a
/// side tells no ghost.
/// fails: as fit_camera_maps, OwnViews::find, check_maps, measure_ghost and measure_blur; interrupted; as the
/// rig.
Result<Registration> register_views(Probe& rig, const RegistrationOptions& options);

/// Registers a camera that has a pixel for each cell: finds its shift with the axis check (check_coaxial). A
/// shift is known to a tenth of itself, so the check is repeated on the corrected rig, at most twice.
/// A ghost is looked for and subtracted, and the shift found again, if the rig has one view: the light of
/// other views looks like a ghost.
/// Photographs: 8 for each check, one of the flood-lit scene, and 6 for a ghost.
/// fails: as check_coaxial and measure_ghost; bad_value (too dark to be checked); limit (shifted too far).
Result<Registration> register_shared_grid(Probe& rig, const RegistrationOptions& options);

}  // namespace symrig::calibration
