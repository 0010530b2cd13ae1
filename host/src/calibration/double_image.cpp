// SPDX-License-Identifier: Apache-2.0
#include "calibration/double_image.hpp"

#include <cmath>
#include <vector>

namespace symrig::calibration {
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
  const Light there = light_at(a, comb, to), back = light_at(b, comb, from);
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
  std::vector<Light> direct;
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
