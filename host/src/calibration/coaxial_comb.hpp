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

/// Stripes at 0, 1, 3 and three eighths of the period from the first one, which lies up to four pixels from
/// the border, as the last one does. The period is a quarter of the axis, 16 pixels at least. No two pairs of
/// stripes are equally far apart. Where there is no room on the axis the last one is left out. Nothing if the
/// axis has fewer than four pixels.
std::optional<Comb> make_comb(Axis axis, Grid grid);

/// Light of all channels and its variance.
struct Light {
  double value = 0;
  double variance = 0;
  double pixels = 0;  ///< on the grid, dead ones included
};

/// What a photograph shows at this offset from the start of every group, where that is on the grid. Invalid
/// pixels count as the mean of the others (left out, they would break the balance of T), and each adds the
/// scatter of the others to the variance.
Light light_at(const Radiance& photograph, const Comb& comb, int offset);

/// The direct light of a comb: what lies within three pixels of its stripes, less what light spreads smoothly
/// there. That is told by what lies 3.5 pixels away, on the darker side: of light spread as k(d), a shift by
/// m moves Σ_{|d| ≤ 3} d (k(d + m) − k(d)) ≈ −m Σ_{|d| ≤ 3} (k(d) − k(3.5)).
Light direct_light(const Radiance& photograph, const Comb& comb, int offset);

/// How much of the light within three pixels of the stripes direct_light takes off.
double smooth_share(const Radiance& photograph, const Comb& comb, int offset);

/// How far from the stripes most light lies, on the mean of all photographs, if that is further than `near`
/// and a pixel there has twice the light of any nearer one: several views of one scene show a stripe in
/// several places, as brightly. With several groups it is known within half a period either way.
std::optional<int> light_elsewhere(const Comb& comb, std::span<const Radiance> photographs, int near);

}  // namespace symrig::calibration
