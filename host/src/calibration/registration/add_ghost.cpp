// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/add_ghost.hpp"

#include "calibration/registration/ghost_subtraction.hpp"

namespace symrig::calibration {
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

}  // namespace symrig::calibration
