// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/image/outline.hpp"

#include <span>
#include <vector>

namespace symrig {

/// A second, weaker picture in the camera: light from the second surface of a plate beam splitter.
///
/// With the first picture E, a camera pixel that looks at x sees (1 − share) E(x) + share E(x + place). The
/// ghost is on the camera's side only, so it makes T one-sided: light goes from x + place to x, and none
/// goes back.
struct CameraGhost {
  bool found = false;
  double share = 0;  ///< of the light, 0 to largest_share
  double sigma = 0;  ///< standard deviation of the share
  Point place;       ///< [cells] rows, columns
  /// Of the best candidate, in standard deviations of the others. Also known if no ghost was found.
  double significance = 0;

  /// A larger one is a fault of the optics.
  static constexpr double largest_share = 0.2;
  /// A smaller one adds less error than the noise of the camera.
  static constexpr double smallest_share = 1e-3;
  /// [cells] A nearer one cannot be told from blur.
  static constexpr double nearest = 2;
  /// [cells] Of a smaller grid: a third of its side.
  static constexpr int farthest = 32;
  /// A candidate needs them. A scene without a ghost has one of up to 5.
  static constexpr double sigmas = 6;
};

/// Dots of 2 × 2 cells, one at a random place in each 6 × 6 cells. 6 patterns.
std::vector<Pattern> ghost_patterns(Grid cells);

/// Looks for a ghost by photographs of ghost_patterns().
///
/// A cell is dark if it and its neighbours are not lit. Interreflections of the scene are smooth, so they
/// give a dark cell nearly the same light under each of the patterns, whose dots are even; the mean is
/// subtracted. A ghost adds share times the photograph at x + place, which differs from pattern to pattern.
/// So each place is judged by the regression of what dark cells see on what the photographs show there, with
/// outliers clamped. The place opposite is judged too: light that the scene exchanges goes both ways
/// (Helmholtz reciprocity), and cancels in the difference. Then share and place are fitted robustly on the
/// camera's pixels.
/// Photographs: 6. rig: its photographs are on the camera's grid. by_area: brings them to the cells. corners:
/// of its maps.
/// A ghost that is nearer than 2 cells, farther than a third of the grid, or from light that is not lit by
/// the patterns, is not found. A grid with fewer than 12 rows or columns is not measured.
/// fails: as the rig; interrupted; size_mismatch.
Result<CameraGhost> measure_ghost(Probe& rig, const CellWeights& by_area, std::span<const CornerMap> corners,
                                  const Progress& progress = {});

/// The photograph without the ghost: (y − share · x displaced) / (1 − share), solved by substitution until
/// what is left is below 1e-5 of the light. A pixel whose ghost comes from outside of the camera's picture
/// keeps its light. If it comes from pixels that are all invalid, the pixel becomes invalid. The variance is
/// that of both pixels. The camera's gain is taken to be the same at both.
/// ghost: found or not, it is subtracted. corners: one map for each channel, or one for all.
/// fails: size_mismatch; bad_value (a share or a place that no ghost has).
Result<Radiance> without_ghost(const Radiance& photograph, std::span<const CornerMap> corners,
                               const CameraGhost& ghost);

}  // namespace symrig
