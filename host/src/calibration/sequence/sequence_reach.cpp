// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence/sequence_verdicts.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace symrig::calibration {
namespace {

/// The position along one axis that the bits give; −1 if a bit has no clear sign.
int spelt(const SequenceLight& light, StripeAxis axis, std::size_t pixel) {
  constexpr int kFine = 2;  // bits whose stripes may be blurred; they change a position by a few pixels
  const GrayCode& code = light.photographs.code;
  const int first = axis == StripeAxis::columns ? 0 : code.column_bits(), bits = code.bits(axis);
  const float level = light.clear_difference(pixel);
  int bit = 0, value = 0;
  for (int k = first; k < first + bits; ++k) {
    const float d = light.difference(k, pixel);
    if (k < first + bits - kFine && std::abs(d) < level) return -1;
    bit ^= d > 0 ? 1 : 0;
    value = 2 * value + bit;
  }
  return value;
}

constexpr int kApart = 4;               // projector pixels between neighbours of one surface
constexpr double kMostMirrored = 0.02;  // of the positions that a swapped coarsest pair puts beyond `size`

/// How far clear positions lie beyond `size` whose neighbours lie there too: the 90 % quantile. None if fewer
/// than 1 in 200 do.
CodeReach::OfAxis reach_beyond(const SequenceLight& light, StripeAxis axis, int size) {
  constexpr double kLeast = 0.005;
  const int last = (1 << light.photographs.code.bits(axis)) - 1;
  double clear = 0, mirrored = 0;
  std::vector<int> beyond;
  for (const std::size_t i : light.sample) {
    const int at = spelt(light, axis, i);
    if (at < 0) continue;
    clear += 1;
    mirrored += last - at >= size + kApart ? 1 : 0;
    if (at < size + kApart || i + 1 >= light.amplitude.values().size()) continue;
    const int next = light.amplitude.values()[i + 1] > 0 ? spelt(light, axis, i + 1) : -1;
    if (next >= 0 && std::abs(next - at) <= kApart) beyond.push_back(at);
  }
  constexpr std::size_t kFewestSpelt = 10;
  if (beyond.size() < kFewestSpelt || static_cast<double>(beyond.size()) < kLeast * clear) return {};
  return {ranked(beyond, std::ssize(beyond) * 9 / 10), mirrored < kMostMirrored * clear};
}

/// Some programs put the projector into the middle of the code's range: 24 rows of 32 are positions 4 to 27.
/// Then as many positions lie beyond `size` as are missing at the beginning.
CodeReach::OfAxis centred_reach(const SequenceLight& light, StripeAxis axis, int size) {
  constexpr double kFewestBeyond = 0.5, kMostBelow = 0.1;  // of the share that a centred pattern has there
  constexpr std::ptrdiff_t kFewestSpelt = 200;
  const int all = 1 << light.photographs.code.bits(axis), offset = (all - size) / 2;
  if (offset < 2) return {};
  std::vector<int> positions;
  for (const std::size_t i : light.sample)
    if (const int at = spelt(light, axis, i); at >= 0) positions.push_back(at);
  const auto count = [&](int from, int to) {
    double inside = 0;
    for (const int at : positions) inside += at >= from && at < to ? 1 : 0;
    return inside;
  };
  const double there = static_cast<double>(positions.size()) * offset / size;
  if (std::ssize(positions) < kFewestSpelt || count(size, size + offset) < kFewestBeyond * there ||
      count(0, offset) + count(size + offset, all) > kMostBelow * there)
    return {};
  const double mirrored = count(0, all - size - kApart);
  CodeReach::OfAxis found;
  found.first = quantile(positions, 0.01);
  found.last = quantile(positions, 0.99);
  found.swapped = mirrored < kMostMirrored * static_cast<double>(positions.size());
  return found;
}

/// Whether neighbours in the camera are mirrored in the projector: the sign of the map's determinant.
bool is_mirrored(const SequenceLight& light) {
  constexpr std::size_t kAside = 4;      // camera pixels
  constexpr int kFarthest = 8 * kAside;  // projector pixels between neighbours of one surface
  const std::size_t width = light.photographs.camera().cols, all = light.amplitude.values().size();
  double turned = 0, mirrored = 0;
  for (const std::size_t i : light.sample) {
    if (i + kAside * width + kAside >= all) continue;
    std::array<std::array<int, 3>, 2> at{};
    bool spelled = true;
    for (const StripeAxis axis : {StripeAxis::columns, StripeAxis::rows}) {
      auto& of = at[axis == StripeAxis::rows];
      of = {spelt(light, axis, i), spelt(light, axis, i + kAside), spelt(light, axis, i + kAside * width)};
      for (const int one : of) spelled = spelled && one >= 0 && std::abs(one - of[0]) <= kFarthest;
    }
    if (!spelled) continue;
    const auto& [x, y] = at;
    const int handed = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    turned += handed > 0 ? 1 : 0, mirrored += handed < 0 ? 1 : 0;
  }
  return mirrored > turned;
}

}  // namespace

CodeReach find_reach_beyond(const SequenceLight& light) {
  const GrayCode& code = light.photographs.code;
  if (static_cast<int>(light.pairs.size()) < code.pairs()) return {};
  const auto reach = [&](StripeAxis axis, int size) {
    const CodeReach::OfAxis centred = centred_reach(light, axis, size);
    return centred.first > 0 ? centred : reach_beyond(light, axis, size);
  };
  CodeReach found{reach(StripeAxis::columns, code.projector().cols),
                  reach(StripeAxis::rows, code.projector().rows)};
  const auto is_outside = [](const CodeReach::OfAxis& axis) { return axis.first > 0 || axis.farthest > 0; };
  if (!is_outside(found.columns) && !is_outside(found.rows)) return found;
  found.mirrored = is_mirrored(light);
  const Grid projector = code.projector();
  found.exchanged = code.row_bits() == code.column_bits() &&
                    reach_beyond(light, StripeAxis::columns, projector.rows).farthest == 0 &&
                    reach_beyond(light, StripeAxis::rows, projector.cols).farthest == 0;
  return found;
}

}  // namespace symrig::calibration
