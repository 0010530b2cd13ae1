// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"

#include <array>
#include <cstdint>

namespace symrig {

/// How much more the camera's optics favour a cell than the projector's do: g = c / p, with mean log g = 0.
///
/// With gains c(i) of the camera and p(j) of the projector, a rig measures C K P with a symmetric K. The
/// product with 1 / g is P K P: symmetric again, and what the projector's own light makes of the scene. log g
/// is a sum of four shapes over the grid. Gains contain everything that differs between the two directions:
/// vignetting, and solid angles. A camera's pixel measures the radiance from its solid angle dω_c and a
/// projector's cell sends light into its solid angle dω_p, so K is symmetric if both are counted per solid
/// angle. A cell of the grid has dω_c and dω_p of its own (∝ cos³ of its angle to the axis behind a
/// perspective lens). Their ratio is smooth over the grid, and thus a part of g.
struct GainRatio {
  /// Of y, x, r², r⁴, each less its mean: y and x from the middle of the grid to half of its diagonal, r² =
  /// y² + x².
  std::array<double, 4> shape{};
  double sigma = 0;  ///< rms standard deviation of log g over the cells, by noise and by the shapes' misfit
  /// Share of a photograph's light that glare puts into each of 4 × 4 blocks (veiling glare), and its
  /// standard deviation.
  double veil = 0, veil_sigma = 0;
  std::int64_t pairs = 0;  ///< pairs of blocks that exchange enough light
  bool known = false;      ///< false: the scene's blocks exchange too little light; g = 1

  /// g of each cell.
  Image<float> over(Grid cells) const;
  /// The largest g divided by the smallest.
  double spread(Grid cells) const;
};

/// Measures it by reciprocity: 4 × 4 blocks are lit in turn, and the light of block B seen in block B′ is
/// compared with that of B′ seen in B, for blocks that do not touch. Each ratio is that of the means of g,
/// weighted by the light received; a part `veil` of a photograph's light is subtracted in each block.
/// Photographs: 16. probe: its photographs are on the cells. seen: 1 for the cells that the camera sees.
/// A grid with fewer than 8 rows or columns is not measured.
/// fails: as the probe; interrupted; size_mismatch.
Result<GainRatio> measure_gain_ratio(Probe& probe, const Image<std::uint8_t>& seen,
                                     const Progress& progress = {});

}  // namespace symrig
