// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <optional>
#include <span>
#include <vector>

namespace symrig::calibration {

enum class CombAxis : bool { rows, cols };  ///< along which positions are counted

/// Thin stripes across one axis: stripe s of group g lies at offsets[s] + g · period. All groups are
/// complete.
struct Comb {
  CombAxis axis = CombAxis::cols;
  Grid grid;
  int period = 0;
  int groups = 0;
  std::vector<int> offsets;

  int length() const { return axis == CombAxis::cols ? grid.cols : grid.rows; }
  int width() const { return axis == CombAxis::cols ? grid.rows : grid.cols; }
  Pattern pattern(int offset) const;
};

/// Stripes at 0, 1, 3 and three eighths of the period from the first one. The first and the last one lie up
/// to four pixels from the border. The period is a quarter of the axis, at least 16 pixels. No two pairs of
/// stripes have the same distance. If the axis is too short, the last stripe is omitted. Nothing if the axis
/// has fewer than four pixels.
std::optional<Comb> make_comb(CombAxis axis, Grid grid);

/// Light of all channels and its variance.
struct CombLight {
  double value = 0;
  double variance = 0;
  double pixels = 0;  ///< on the grid, including invalid ones
};

/// The light of a photograph at this offset from the start of every group, as far as it lies on the grid.
/// Invalid pixels count as the mean of the others, because omitting them would break the symmetry of T. Each
/// of them adds the scatter of the others to the variance.
CombLight light_at(const Radiance& photograph, const Comb& comb, int offset);

/// The direct light of a comb: the light within three pixels of its stripes, minus the smooth light there.
/// The smooth light is that at 3.5 pixels, on the darker side. For light spread as k(d), a shift by m moves
/// Σ_{|d| ≤ 3} d (k(d + m) − k(d)) ≈ −m Σ_{|d| ≤ 3} (k(d) − k(3.5)).
CombLight direct_light(const Radiance& photograph, const Comb& comb, int offset);

/// The share of the light within three pixels of the stripes that direct_light subtracts.
double smooth_share(const Radiance& photograph, const Comb& comb, int offset);

/// The distance of most light from the stripes, on the mean of all photographs. Nothing unless it is further
/// than `near` and a pixel there has twice the light of any nearer pixel. The reason: several views of one
/// scene show a stripe in several places with equal brightness. With several groups the distance is known
/// within half a period either way.
std::optional<int> light_elsewhere(const Comb& comb, std::span<const Radiance> photographs, int near);

/// r(d): the difference of the light that two stripes d pixels apart send each other, over their direct
/// light.
struct Imbalance {
  int distance = 0;
  double value = 0;
  double sigma = 0;
};

/// A one-sided exponential flare.
struct Flare {
  double share = 0;         ///< of all light; negative: towards smaller positions
  double sigma = 0;         ///< from noise and from the range of lengths that fit equally well
  double length = 1;        ///< [pixels]
  double significance = 0;  ///< √(χ² without flare − χ² with it)
};

/// r(d) of a flare of share 1: (1 − k) k^d, k = exp(−1 / length), over all pairs of groups. The farther pairs
/// see it with the opposite sign.
double flare_imbalance(const Comb& comb, int distance, double length);

/// Least squares over share and length.
Flare fit_flare(std::span<const Imbalance> found, const Comb& comb);

/// A second picture of the lit pixels, `shift` pixels further along the axis (negative: back).
struct DoubleImage {
  int shift = 0;
  double share = 0, sigma = 0;  ///< of the light
};

/// The suspected place of a second picture, from the photographs of the stripes alone. It is the distance 0 <
/// d < period from every stripe with the most light above that of two pixels before and behind. Indirect
/// light is smooth, and a mirror in the scene has different distances from stripes in different places. So
/// few clean rigs are suspected. nullopt: no excess of `least` of the direct light.
std::optional<int> suspect_double_image(const Comb& comb, std::span<const Radiance> photographs,
                                        double least);

/// The proof, with one more photograph, of stripes at the second picture of the first ones. For a symmetric T
/// the light that goes there minus the light that comes back is 0, for any scene. A flare and a shift change
/// this difference too, but equally at distances three pixels apart. So the difference of the two is the
/// second picture's share. At half a period nothing is proven, because the second pictures of both stripes
/// coincide.
/// there: the photograph of comb.pattern(comb.offsets.front() + distance).
DoubleImage prove_double_image(const Comb& comb, std::span<const Radiance> photographs, const Radiance& there,
                               int distance);

}  // namespace symrig::calibration
