// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/radiance.hpp"

#include <optional>
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

/// Offsets 0, 1, 3 and one at three eighths of the period, a quarter of the axis. Nothing if the axis has
/// fewer than four pixels.
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

/// The direct light of a comb: what lies within three pixels of its stripes, less as much of what lies half a
/// period away.
Light direct_light(const Radiance& photograph, const Comb& comb, int offset);

}  // namespace symrig::calibration
