// SPDX-License-Identifier: Apache-2.0
#include "calibration/alignment/edge_focus.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

namespace symrig::calibration {
namespace {

/// [cells] Distance from a border within which pixels count, and the width of a bin of distances.
constexpr double kReach = 2, kBin = 0.1;
/// [blocks] The same where blocks are narrow: farther pixels see the next border.
constexpr double kWithin = 0.4;
constexpr int kBins = static_cast<int>(2 * kReach / kBin);
/// [cells] The blurs that are tried. A registration refuses the last.
constexpr double kStep = 0.02;
constexpr int kSteps = 100;
/// A tile with fewer pixels near borders has no focus.
constexpr double kFewest = 200;

}  // namespace

/// What pixels see, by their distance from an edge.
struct EdgeFocus::Profile {
  std::array<double, kBins> sum{}, count{};
  double widths = 0, pixels = 0;

  std::optional<double> misfit(double sigma) const;
  TileFocus focus() const;
};

namespace {

/// The share of an edge's light at a distance from it.
double edge(double distance, double width, double sigma) {
  const auto ramp = [sigma](double x) {
    if (sigma == 0) return std::max(x, 0.0);
    const double u = x / sigma;
    return x * 0.5 * std::erfc(-u / std::numbers::sqrt2) +
           sigma * std::exp(-0.5 * u * u) / std::sqrt(2 * std::numbers::pi);
  };
  return (ramp(distance + 0.5 * width) - ramp(distance - 0.5 * width)) / width;
}

}  // namespace

/// Least squares of a + b S: the sum of squares that is left, or nothing if the profile shows no edge.
std::optional<double> EdgeFocus::Profile::misfit(double sigma) const {
  const double width = widths / pixels;
  double n = 0, s = 0, ss = 0, y = 0, sy = 0, yy = 0;
  for (int k = 0; k < kBins; ++k) {
    if (count[k] == 0) continue;
    const double at = edge((k + 0.5) * kBin - kReach, width, sigma), weight = count[k];
    const double value = sum[k] / count[k];
    n += weight, s += weight * at, ss += weight * at * at;
    y += weight * value, sy += weight * at * value, yy += weight * value * value;
  }
  const double spread = n * ss - s * s, product = n * sy - s * y;
  if (!(spread > 0) || product <= 0) return std::nullopt;
  return yy - y * y / n - product * product / (n * spread);
}

TileFocus EdgeFocus::Profile::focus() const {
  if (pixels < kFewest) return {};
  TileFocus found;
  double least = 0;
  for (int k = 0; k <= kSteps; ++k) {
    const double sigma = k * kStep;
    const auto left = misfit(sigma);
    if (!left || (found.known && *left >= least)) continue;
    found = {true, sigma};
    least = *left;
  }
  return found;
}

/// The pixels on the line through the two of the edge.
void EdgeFocus::add(const CoarseEdge& edge, Profile& profile) const {
  const auto cell = [&](double row, double col) {
    const Point to = map_.look({row, col});
    return edge.axis == StripeAxis::rows ? to.row : to.col;
  };
  const double here = cell(edge.at.row, edge.at.col);
  const double down = cell(edge.at.row + 1, edge.at.col) - here,
               right = cell(edge.at.row, edge.at.col + 1) - here;
  // [cells] for a step along the line. Along a border, pixels tell nothing of its width.
  const double step = edge.down ? down : right;
  if (std::abs(step) < std::abs(edge.down ? right : down) || step == 0) return;
  const int side = edge.axis == StripeAxis::rows ? code_.block().rows : code_.block().cols;
  const double reach = std::min(kReach, kWithin * side);
  const int pair = pixels_.pair_of(edge.axis, edge.border);
  const bool rises = code_.code().lit(pair, edge.border);
  const int steps = static_cast<int>(reach / std::abs(step));
  for (int k = -steps; k <= steps + 1; ++k) {
    const int row = edge.row + (edge.down ? k : 0), col = edge.col + (edge.down ? 0 : k);
    const Grid camera = pixels_.camera();
    if (row < 0 || col < 0 || row >= camera.rows || col >= camera.cols || !pixels_.good(row, col)) continue;
    const double distance = step * (edge.down ? row + 0.5 - edge.at.row : col + 0.5 - edge.at.col);
    if (std::abs(distance) >= reach) continue;
    const double ratio = pixels_.ratio(row, col, pair), share = 0.5 + (rises ? 0.5 : -0.5) * ratio;
    const int bin = std::clamp(static_cast<int>((distance + kReach) / kBin), 0, kBins - 1);
    profile.sum[bin] += share;
    profile.count[bin] += 1;
    profile.widths += std::abs(down) + std::abs(right);
    profile.pixels += 1;
  }
}

std::array<TileFocus, 9> EdgeFocus::measure(std::span<const CoarseEdge> edges) const {
  std::array<Profile, 9> profiles{};
  const Grid camera = pixels_.camera();
  for (const CoarseEdge& edge : edges)
    add(edge, profiles[3 * static_cast<std::size_t>(3 * edge.row / camera.rows) +
                       static_cast<std::size_t>(3 * edge.col / camera.cols)]);
  std::array<TileFocus, 9> found;
  std::ranges::transform(profiles, found.begin(), [](const Profile& p) { return p.focus(); });
  return found;
}

}  // namespace symrig::calibration
