// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/cell_weights.hpp"

#include <cstdint>
#include <vector>

namespace symrig {

/// How far the optics of camera and projector spread light: the rms width of each blur along an axis [cells].
/// The camera's contains the size of its pixels.
///
/// With blurs G of both optics a rig measures G_c K G_p: not symmetric unless they are equal. A picture that
/// is blurred by the difference of the squares is symmetric again, if the projector is the blurrier one. The
/// opposite case cannot be corrected.
struct OpticsBlur {
  double projector = 0, camera = 0;
  /// Standard deviation of their difference: scenes without texture do not tell it.
  double sigma = 0;
  bool measured = false;
  /// Light that gets into the far half of the next cell, by that in its near half. Blur of the optics alone
  /// gives far_light(its rms width). Light that scatters below the surface gives more. Not kept in files.
  double far = 0;

  /// Variance that the cells of photographs lack [cells²]; 0 if the camera is the blurrier one. Weights by
  /// area spread the light of a pixel over all of it, which is a second blur of its size. pixel: its side
  /// [cells].
  double missing(double pixel) const;
  /// `far` of a Gaussian blur of this rms width [cells].
  static double far_light(double width);
};

/// Photographs of combs on the camera's grid: every fourth column of cells is lit, then every fourth row.
/// Photograph k lights those whose number is k more than a multiple of four.
struct CombPhotographs {
  static constexpr int period = 4;
  std::vector<Radiance> columns, rows;  ///< empty: the cells have fewer than four rows or columns
};

/// Takes them: 8 photographs.
/// fails: as the rig; interrupted.
Result<CombPhotographs> photograph_combs(Probe& rig, const Progress& progress = {});

/// What brings the photographs of the combs to the cells, all weighted by area.
struct BlurWeights {
  const CellWeights& cells;
  const CellWeights& quarters;      ///< on a grid of 2 × 2 for each cell
  const Image<float>& flood;        ///< the flood-lit scene on that grid
  const Image<std::uint8_t>& seen;  ///< as measure_gain_ratio
};

/// Measures both from combs.
///
/// f is the light of the next column seen in a cell and g the reverse, each less the light under the comb
/// that is farthest away; a is a cell's own light. Then
///
///   (f + g) / (a + a′) = √(σp² + σc²) / √(2π)      f − g = δ √(a a′) + (σp − σc) / √(2π) · (a − a′)
///
/// with the residual shift δ, one for each 8 × 8 cells. In the last term, a and a′ are the light of the
/// halves of the cells that touch the border. The projector's blur lights the near half of the other
/// cell, and the camera's blur shows it. A cell's light is a and what crosses its two borders.
/// fails: size_mismatch.
Result<OpticsBlur> measure_blur(const CombPhotographs& combs, const BlurWeights& weights);

}  // namespace symrig
