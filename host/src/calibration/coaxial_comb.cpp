// SPDX-License-Identifier: Apache-2.0
#include "calibration/coaxial_comb.hpp"

#include <algorithm>

namespace symrig::calibration {
namespace {

constexpr int kReach = 3;  // pixels that direct light may be off its place

/// Raster index of a position along the axis and one across it.
std::size_t pixel(const Comb& comb, int along, int across) {
  const int row = comb.axis == Axis::cols ? across : along;
  const int col = comb.axis == Axis::cols ? along : across;
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(comb.grid.cols) +
         static_cast<std::size_t>(col);
}

/// Calls visit(raster index) for each pixel at this offset of every group.
template <class Visit>
void each_pixel(const Comb& comb, int offset, const Visit& visit) {
  for (int group = 0; group < comb.groups; ++group) {
    const int along = offset + group * comb.period;
    if (along < 0 || along >= comb.length()) continue;
    for (int across = 0; across < comb.width(); ++across) visit(pixel(comb, along, across));
  }
}

}  // namespace

Pattern Comb::pattern(int offset) const {
  Pattern lit(grid);
  each_pixel(*this, offset, [&](std::size_t at) { lit.values()[at] = 1; });
  return lit;
}

std::optional<Comb> make_comb(Axis axis, Grid grid) {
  Comb comb{axis, grid, 0, 1, {0, 1, 3}};
  if (comb.length() <= kReach) return std::nullopt;
  comb.period = std::max(8, comb.length() / 4);
  const int far = 3 * comb.period / 8 + 1;
  if (far < comb.length()) comb.offsets.push_back(far);
  comb.groups = 1 + std::max(0, (comb.length() - 1 - comb.offsets.back()) / comb.period);
  return comb;
}

Light light_at(const Radiance& photograph, const Comb& comb, int offset) {
  Light light;
  double seen = 0, squares = 0;
  for (int channel = 0; channel < photograph.mean.channels(); ++channel) {
    const auto mean = photograph.mean.plane(channel), variance = photograph.variance.plane(channel);
    const auto valid = photograph.valid.plane(channel);
    each_pixel(comb, offset, [&](std::size_t at) {
      light.pixels += 1;
      if (valid[at] == 0) return;
      seen += 1;
      light.value += mean[at];
      squares += static_cast<double>(mean[at]) * mean[at];
      light.variance += variance[at];
    });
  }
  if (seen == 0) return {0, 0, light.pixels};
  const double average = light.value / seen, scatter = std::max(0.0, squares / seen - average * average);
  const double all = light.pixels / seen;
  return {all * light.value, all * all * light.variance + (light.pixels - seen) * scatter, light.pixels};
}

Light direct_light(const Radiance& photograph, const Comb& comb, int offset) {
  const Light away = light_at(photograph, comb, offset + comb.period / 2);
  Light direct;
  for (int d = -kReach; d <= kReach; ++d) {
    const Light here = light_at(photograph, comb, offset + d);
    direct.value += here.value;
    direct.variance += here.variance;
    direct.pixels += here.pixels;
  }
  if (away.pixels == 0) return direct;
  const double share = direct.pixels / away.pixels;
  direct.value -= share * away.value;
  direct.variance += share * share * away.variance;
  return direct;
}

}  // namespace symrig::calibration
