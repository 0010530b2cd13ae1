// SPDX-License-Identifier: Apache-2.0
#include "calibration/axis/coaxial_comb.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::calibration {
namespace {

constexpr int kReach = 3;  // pixels; largest displacement of direct light

/// Raster index of a position along the axis and one across it.
std::size_t pixel(const Comb& comb, int along, int across) {
  const int row = comb.axis == CombAxis::cols ? across : along;
  const int col = comb.axis == CombAxis::cols ? along : across;
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

std::optional<Comb> make_comb(CombAxis axis, Grid grid) {
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

CombLight light_at(const Radiance& photograph, const Comb& comb, int offset) {
  CombLight light;
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
CombLight beside(const Radiance& photograph, const Comb& comb, int offset, int near) {
  CombLight darker;
  for (const int side : {-1, 1}) {
    CombLight here = light_at(photograph, comb, offset + side * near);
    const CombLight next = light_at(photograph, comb, offset + side * (near + 1));
    here.value += next.value, here.variance += next.variance, here.pixels += next.pixels;
    if (here.pixels == 0) continue;
    here = {here.value / here.pixels, here.variance / (here.pixels * here.pixels), here.pixels};
    if (darker.pixels == 0 || here.value < darker.value) darker = here;
  }
  return darker;
}

}  // namespace

CombLight direct_light(const Radiance& photograph, const Comb& comb, int offset) {
  const CombLight away = beside(photograph, comb, offset, kReach);
  CombLight direct;
  for (int d = -kReach; d <= kReach; ++d) {
    const CombLight here = light_at(photograph, comb, offset + d);
    direct.value += here.value;
    direct.variance += here.variance;
    direct.pixels += here.pixels;
  }
  direct.value -= direct.pixels * away.value;
  direct.variance += direct.pixels * direct.pixels * away.variance;
  return direct;
}

double smooth_share(const Radiance& photograph, const Comb& comb, int offset) {
  CombLight near;
  for (int d = -kReach; d <= kReach; ++d) {
    const CombLight here = light_at(photograph, comb, offset + d);
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
    CombLight there;
    for (std::size_t i = 0; i < photographs.size(); ++i) {
      const CombLight one = light_at(photographs[i], comb, comb.offsets[i] + d);
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

namespace {

constexpr double kStep = 1.1;  // ratio of one trial length to the one before

/// The best share at one length, and how much it lowers χ².
struct ShareFit {
  double share = 0, sigma = 0, length = 1, gain = 0;
};

/// min over s of Σ (r − s f)² / σ²: s = Σ r f / σ² / Σ f² / σ²; χ² falls by (Σ r f / σ²)² / Σ f² / σ².
ShareFit fit_share(std::span<const Imbalance> found, const Comb& comb, double length) {
  double rf = 0, ff = 0;
  for (const Imbalance& one : found) {
    const double f = flare_imbalance(comb, one.distance, length), weight = 1 / (one.sigma * one.sigma);
    rf += weight * one.value * f;
    ff += weight * f * f;
  }
  if (!(ff > 0)) return {};
  return {rf / ff, 1 / std::sqrt(ff), length, rf * rf / ff};
}

/// The shortest length that the far stripes can see: a shorter flare falls below 5 % before it reaches them.
double shortest_length(const Comb& comb) {
  return std::max(1, comb.offsets.back()) / 3.0;
}

}  // namespace

double flare_imbalance(const Comb& comb, int distance, double length) {
  const double k = std::exp(-1 / length);
  double sum = std::pow(k, distance);
  for (int apart = 1; apart < comb.groups; ++apart) {
    const double pairs = (comb.groups - apart) / static_cast<double>(comb.groups);
    sum +=
        pairs * (std::pow(k, apart * comb.period + distance) - std::pow(k, apart * comb.period - distance));
  }
  return (1 - k) * sum;
}

Flare fit_flare(std::span<const Imbalance> found, const Comb& comb) {
  std::vector<ShareFit> fits;
  const double shortest = shortest_length(comb);
  const int steps = static_cast<int>(std::log(comb.length() / shortest) / std::log(kStep));
  for (int step = 0; step <= steps; ++step)
    fits.push_back(fit_share(found, comb, shortest * std::pow(kStep, step)));
  const ShareFit best = *std::ranges::max_element(fits, {}, &ShareFit::gain);
  double low = best.share, high = best.share;
  for (const ShareFit& fit : fits) {
    if (fit.gain < best.gain - 1) continue;
    low = std::min(low, fit.share);
    high = std::max(high, fit.share);
  }
  return {best.share, std::hypot(best.sigma, (high - low) / 2), best.length, std::sqrt(best.gain)};
}

namespace {

constexpr int kDirectReach = 3;    // pixels; largest displacement of direct light
constexpr int kPicturesApart = 2;  // pixels; a blurred second picture does not reach this far

/// Light at this offset from the start of every group, minus the mean of the light kPicturesApart before and
/// behind it.
double standing_out(const Radiance& photograph, const Comb& comb, int offset) {
  const auto at = [&](int place) { return light_at(photograph, comb, place).value; };
  return at(offset) - (at(offset - kPicturesApart) + at(offset + kPicturesApart)) / 2;
}

/// (Light from stripes at `from` to `to`) − (light in the other direction), over the direct light.
Imbalance exchange(const Comb& comb, const Radiance& a, int from, const Radiance& b, int to) {
  const CombLight there = light_at(a, comb, to), back = light_at(b, comb, from);
  const double direct = (direct_light(a, comb, from).value + direct_light(b, comb, to).value) / 2;
  return {to - from, (there.value - back.value) / direct, std::sqrt(there.variance + back.variance) / direct};
}

/// Whether the second picture lies `distance` ahead, or period − distance back. Both put light at the same
/// places, except one behind the last stripe.
bool lies_ahead(const Comb& comb, const Radiance& photograph, int distance) {
  const int behind = (comb.groups - 1) * comb.period, place = comb.offsets.front() + distance;
  if (behind + place + kPicturesApart >= comb.length()) return 2 * distance <= comb.period;
  Comb last = comb;
  last.groups = 1;
  return standing_out(photograph, last, behind + place) >
         standing_out(photograph, comb, place) / comb.groups / 2;
}

}  // namespace

std::optional<int> suspect_double_image(const Comb& comb, std::span<const Radiance> photographs,
                                        double least) {
  std::vector<CombLight> direct;
  for (std::size_t i = 0; i < photographs.size(); ++i) {
    direct.push_back(direct_light(photographs[i], comb, comb.offsets[i]));
    if (!(direct.back().value > 5 * std::sqrt(direct.back().variance))) return std::nullopt;
  }
  std::optional<int> found;
  double most = least;
  const int nearest = kDirectReach + kPicturesApart + 1;
  for (int distance = nearest; distance <= comb.period - nearest; ++distance) {
    if (comb.offsets.front() + distance >= comb.length()) break;
    double share = 0;
    for (std::size_t i = 0; i < photographs.size(); ++i)
      share += standing_out(photographs[i], comb, comb.offsets[i] + distance) / direct[i].value;
    share /= static_cast<double>(photographs.size());
    if (share > most) most = share, found = distance;
  }
  return found;
}

DoubleImage prove_double_image(const Comb& comb, std::span<const Radiance> photographs, const Radiance& there,
                               int distance) {
  const int second = comb.offsets.front() + distance;
  // One stripe of the comb is three pixels nearer to the second picture than the first one.
  std::optional<Imbalance> far, near;
  for (std::size_t i = 0; i < photographs.size(); ++i) {
    if (comb.offsets[i] == comb.offsets.front())
      far = exchange(comb, photographs[i], comb.offsets[i], there, second);
    if (comb.offsets[i] == comb.offsets.front() + kDirectReach)
      near = exchange(comb, photographs[i], comb.offsets[i], there, second);
  }
  if (!far || !near) return {};
  const bool ahead = lies_ahead(comb, photographs.front(), distance);
  // The second picture has the blur of the first: this share of its light lies at the measured place.
  const double sharp = light_at(photographs.front(), comb, comb.offsets.front()).value /
                       direct_light(photographs.front(), comb, comb.offsets.front()).value;
  return {ahead ? distance : distance - comb.period, (far->value - near->value) / sharp,
          std::hypot(far->sigma, near->sigma) / sharp};
}

}  // namespace symrig::calibration
