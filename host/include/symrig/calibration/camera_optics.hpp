// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/image/outline.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

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
