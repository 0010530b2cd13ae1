// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/ghost.hpp"

#include "calibration/registration/ghost_fit.hpp"
#include "calibration/registration/ghost_search.hpp"
#include "calibration/registration/photograph_each.hpp"
#include "symrig/base/random.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace symrig {

using calibration::GhostCandidate;

namespace {

constexpr int kPatterns = 6, kDot = 2, kDotTile = 6;
/// Light that the scene exchanges goes both ways, to the gain ratio of the optics. So of a one-sided light,
/// less than this share comes back.
constexpr double kMostOpposite = 0.5;
/// Relative error of a share, because light between pixels is interpolated. Measured on a plane: 0.017.
constexpr double kBetweenPixels = 0.02;

bool is_ghost(const CameraGhost& ghost, double opposite) {
  const double away = std::max(std::abs(ghost.place.row), std::abs(ghost.place.col));
  return ghost.significance > CameraGhost::sigmas && ghost.share > CameraGhost::smallest_share &&
         ghost.share <= CameraGhost::largest_share && away >= CameraGhost::nearest &&
         std::abs(opposite) < kMostOpposite * ghost.share;
}

Result<GhostCandidate> candidate_of(std::span<const Pattern> patterns, std::span<const Radiance> photographs,
                                    const CellWeights& by_area) {
  std::vector<Radiance> on_cells;
  for (const Radiance& one : photographs) {
    SYMRIG_TRY(Radiance seen, by_area.gather(one));
    on_cells.push_back(std::move(seen));
  }
  return calibration::find_ghost(patterns, on_cells);
}

/// A ghost puts light at other places too, because dots are random. So it is judged by the candidates that
/// are left without it.
Result<CameraGhost> judge(std::span<const Pattern> patterns, std::vector<Radiance> photographs,
                          std::span<const CornerMap> corners, const CellWeights& by_area) {
  SYMRIG_TRY(const GhostCandidate candidate, candidate_of(patterns, photographs, by_area));
  const auto significance = [&](double sigma) { return sigma > 0 ? candidate.share / sigma : 0; };
  CameraGhost none;
  none.significance = significance(candidate.sigma);
  const auto found = calibration::fit_ghost(patterns, photographs, corners, candidate.place);
  // Light that the scene exchanges is seen at both places.
  CameraGhost ghost;
  ghost.share = found.share - found.opposite;
  ghost.place = found.place;
  if (!(ghost.share > CameraGhost::smallest_share && ghost.share <= CameraGhost::largest_share)) return none;
  for (Radiance& one : photographs) {
    SYMRIG_TRY(one, without_ghost(one, corners, ghost));
  }
  SYMRIG_TRY(const GhostCandidate left, candidate_of(patterns, photographs, by_area));
  ghost.significance = significance(left.sigma);
  if (!is_ghost(ghost, found.opposite)) return none;
  ghost.sigma = ghost.share * std::hypot(1 / ghost.significance, kBetweenPixels);
  ghost.found = true;
  return ghost;
}

}  // namespace

std::vector<Pattern> ghost_patterns(Grid cells) {
  std::vector<Pattern> patterns;
  Random random(1);
  for (int k = 0; k < kPatterns; ++k) {
    Pattern& pattern = patterns.emplace_back(cells, 1);
    for (int top = 0; top < cells.rows; top += kDotTile)
      for (int left = 0; left < cells.cols; left += kDotTile) {
        const auto offset = [&] { return static_cast<int>(random.bits() % (kDotTile - kDot + 1)); };
        const int row = top + offset(), col = left + offset();
        for (int r = row; r < std::min(row + kDot, cells.rows); ++r)
          for (int c = col; c < std::min(col + kDot, cells.cols); ++c) pattern.at(r, c) = 1;
      }
  }
  return patterns;
}

Result<CameraGhost> measure_ghost(Probe& rig, const CellWeights& by_area, std::span<const CornerMap> corners,
                                  const Progress& progress) {
  const Grid cells = rig.grid(), camera = rig.camera_grid();
  const bool fit = std::ranges::all_of(corners, [&](const CornerMap& map) {
    return map.grid() == Grid{camera.rows + 1, camera.cols + 1} && map.channels() == 2;
  });
  if (!fit || by_area.cells() != cells || by_area.camera() != camera ||
      (corners.size() != 1 && std::cmp_not_equal(corners.size(), rig.channels())))
    return Error{ErrorCode::size_mismatch, "the maps and weights for ghosts do not fit the rig",
                 "calibrate the rig again"};
  if (std::min(cells.rows, cells.cols) < 2 * kDotTile) return CameraGhost{};
  const std::vector<Pattern> patterns = ghost_patterns(cells);
  SYMRIG_TRY(auto photographs, calibration::photograph_each(rig, patterns, "ghost", progress));
  return judge(patterns, std::move(photographs), corners, by_area);
}

}  // namespace symrig
