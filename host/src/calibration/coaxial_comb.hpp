// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/radiance.hpp"

#include <optional>
#include <span>
#include <vector>

namespace symrig::calibration {

enum class Axis : bool { rows, cols };  ///< along which positions are counted

/// Thin stripes across one axis: stripe s of group g lies at offsets[s] + g · period. All groups are
/// complete.
struct Comb {
  Axis axis = Axis::cols;
  Grid grid;
  int period = 0;
  int groups = 0;
  std::vector<int> offsets;

  int length() const { return axis == Axis::cols ? grid.cols : grid.rows; }
  int width() const { return axis == Axis::cols ? grid.rows : grid.cols; }
  Pattern pattern(int offset) const;
};

/// Stripes at 0, 1, 3 and three eighths of the period from the first one. The first and the last one lie up
/// to four pixels from the border. The period is a quarter of the axis, at least 16 pixels. No two pairs of
/// stripes have the same distance. If the axis is too short, the last stripe is omitted. Nothing if the axis
/// has fewer than four pixels.
std::optional<Comb> make_comb(Axis axis, Grid grid);

/// Light of all channels and its variance.
struct Light {
  double value = 0;
  double variance = 0;
  double pixels = 0;  ///< on the grid, including invalid ones
};

/// The light of a photograph at this offset from the start of every group, as far as it lies on the grid.
/// Invalid pixels count as the mean of the others, because omitting them would break the symmetry of T. Each
/// of them adds the scatter of the others to the variance.
Light light_at(const Radiance& photograph, const Comb& comb, int offset);

/// The direct light of a comb: the light within three pixels of its stripes, minus the smooth light there.
/// The smooth light is that at 3.5 pixels, on the darker side. For light spread as k(d), a shift by m moves
/// Σ_{|d| ≤ 3} d (k(d + m) − k(d)) ≈ −m Σ_{|d| ≤ 3} (k(d) − k(3.5)).
Light direct_light(const Radiance& photograph, const Comb& comb, int offset);

/// The share of the light within three pixels of the stripes that direct_light subtracts.
double smooth_share(const Radiance& photograph, const Comb& comb, int offset);

/// The distance of most light from the stripes, on the mean of all photographs. Nothing unless it is further
/// than `near` and a pixel there has twice the light of any nearer pixel. The reason: several views of one
/// scene show a stripe in several places with equal brightness. With several groups the distance is known
/// within half a period either way.
std::optional<int> light_elsewhere(const Comb& comb, std::span<const Radiance> photographs, int near);

}  // namespace symrig::calibration
