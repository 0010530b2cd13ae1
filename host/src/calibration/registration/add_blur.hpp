// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/registration.hpp"

namespace symrig::calibration {

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

}  // namespace symrig::calibration
