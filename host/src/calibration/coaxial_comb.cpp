// SPDX-License-Identifier: Apache-2.0
#include "calibration/coaxial_comb.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::calibration {
namespace {

constexpr int kReach = 3;  // pixels; largest displacement of direct light

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
  constexpr int kShortest = 16;  // so a stripe seven pixels ahead of one is nine behind the next
  constexpr int kMargin = kReach + 1;
  constexpr int kEnough = 4;  // groups; with so many, the loss at the border is small
  Comb comb{axis, grid, 0, 1, {0, 1, 3}};
  const int length = comb.length();
  if (length <= kReach) return std::nullopt;
  comb.period = std::max(kShortest, length / 4);
  const int far = 3 * comb.period / 8 + 1;
  if (far + 2 * kReach < length) comb.offsets.push_back(far);
  comb.groups = 1 + std::max(0, (length - 1 - comb.offsets.back()) / comb.period);
  if (comb.groups >= kEnough) return comb;
  // Keep a margin, where there is room: a shift of up to three pixels then moves no light off the picture.
  const int first = std::min(kMargin, (length - 1 - comb.offsets.back()) / 2);
  for (int& offset : comb.offsets) offset += first;
  comb.groups = 1 + std::max(0, (length - 1 - comb.offsets.back() - first) / comb.period);
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

namespace {

/// Mean light of the pixels between `near` and `near` + 1 pixels from the stripes, on the darker side. The
/// other side contains light that a shift has moved.
Light beside(const Radiance& photograph, const Comb& comb, int offset, int near) {
  Light darker;
  for (const int side : {-1, 1}) {
    Light here = light_at(photograph, comb, offset + side * near);
    const Light next = light_at(photograph, comb, offset + side * (near + 1));
    here.value += next.value, here.variance += next.variance, here.pixels += next.pixels;
    if (here.pixels == 0) continue;
    here = {here.value / here.pixels, here.variance / (here.pixels * here.pixels), here.pixels};
    if (darker.pixels == 0 || here.value < darker.value) darker = here;
  }
  return darker;
}

}  // namespace

Light direct_light(const Radiance& photograph, const Comb& comb, int offset) {
  const Light away = beside(photograph, comb, offset, kReach);
  Light direct;
  for (int d = -kReach; d <= kReach; ++d) {
    const Light here = light_at(photograph, comb, offset + d);
    direct.value += here.value;
    direct.variance += here.variance;
    direct.pixels += here.pixels;
  }
  direct.value -= direct.pixels * away.value;
  direct.variance += direct.pixels * direct.pixels * away.variance;
  return direct;
}

double smooth_share(const Radiance& photograph, const Comb& comb, int offset) {
  Light near;
  for (int d = -kReach; d <= kReach; ++d) {
    const Light here = light_at(photograph, comb, offset + d);
    near.value += here.value, near.pixels += here.pixels;
  }
  const double smooth = near.pixels * beside(photograph, comb, offset, kReach).value;
  return near.value > 0 ? std::clamp(smooth / near.value, 0.0, 1.0) : 0;
}

std::optional<int> light_elsewhere(const Comb& comb, std::span<const Radiance> photographs, int near) {
  constexpr double kElsewhere = 2;
  int found = 0;
  double most = 0, here = 0;
  for (int d = -comb.length() + 1; d < comb.length(); ++d) {
    if (comb.groups > 1 && (2 * d <= -comb.period || 2 * d > comb.period)) continue;
    Light there;
    for (std::size_t i = 0; i < photographs.size(); ++i) {
      const Light one = light_at(photographs[i], comb, comb.offsets[i] + d);
      there.value += one.value, there.pixels += one.pixels;
    }
    if (there.pixels == 0) continue;
    const double mean = there.value / there.pixels;
    if (mean > most) most = mean, found = d;
    if (std::abs(d) <= near) here = std::max(here, mean);
  }
  if (std::abs(found) <= near || most < kElsewhere * here) return std::nullopt;
  return found;
}

}  // namespace symrig::calibration
