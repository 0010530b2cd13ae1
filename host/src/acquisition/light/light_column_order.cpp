// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_columns.hpp"
#include "acquisition/light/light_tests.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include <fmt/format.h>

// Photograph k of brute force is column k of T, if the rig is in order. Then T is symmetric, and a pixel that
// reflects light holds more of it when it is lit itself than when another one is. So:
// - a *way* (a camera that is late, turned or elsewhere) says which camera pixel would hold the light of
//   photograph k. It is the cause if most photographs follow it, or all from one on.
// - one photograph that shows the pixel before is found by its light there, without light back.
// - light that a projector keeps from the pattern before does the same in every photograph, but weakly.

namespace symrig::acquisition {
namespace {

using Found = std::optional<LightFault>;

constexpr int kFarthest = 16;  // pixels beside
constexpr std::size_t kFewestLit = 8;

std::vector<ColumnWay> all_ways(Grid grid) {
  std::vector<ColumnWay> ways;
  for (std::size_t turn = 0; turn < kTurns; ++turn)
    for (int late = kEarliest; late <= kLatest; ++late)
      ways.push_back({{late, false, static_cast<Turn>(turn)}});
  const int rows = std::min(kFarthest, grid.rows / 2), cols = std::min(kFarthest, grid.cols / 2);
  for (int down = -rows; down <= rows; ++down)
    for (int right = -cols; right <= cols; ++right)
      if (down != 0 || right != 0) ways.push_back({{}, down, right});
  std::erase_if(ways, [](const ColumnWay& way) { return way.own(); });
  return ways;
}

struct Following {
  std::size_t known = 0, follow = 0;
  double share() const { return known > 0 ? static_cast<double>(follow) / static_cast<double>(known) : 0; }
};

/// Of the photographs from `first` on.
Following following(const LightColumns& columns, const ColumnWay& way, std::size_t first = 0) {
  Following found;
  for (std::size_t col = first; col < columns.size(); ++col)
    if (const auto follows = columns.follows(way, col)) ++found.known, found.follow += *follows ? 1 : 0;
  return found;
}

/// A picture that is turned or moved: as much light goes one way as the other only if the scene is the same
/// there.
bool one_way(const LightColumns& columns, const ColumnWay& way) {
  constexpr double kUnlike = 0.05;
  double squares = 0, light = 0;
  for (std::size_t col = 0; col < columns.size(); ++col) {
    const auto row = columns.seen_at(way, col);
    if (!row) continue;
    const double there = columns.light(*row, col), back = columns.light(col, *row);
    squares += (there - back) * (there - back), light += there * there + back * back;
  }
  return squares > kUnlike * kUnlike * light;
}

LightCause cause_of(const ColumnWay& way) {
  if (way.order.right())
    return {"a camera that is not aligned with the projector, or has moved",
            "align them (symrig align), or register the camera (symrig calibrate)"};
  return way.order.late != 0 ? cause_of_order(way.order) : cause_of_turn(way.order.turn);
}

/// Most photographs follow another way than their own.
Found find_way(const LightColumns& columns, const std::vector<ColumnWay>& ways) {
  constexpr double kMost = 0.5, kBetter = 2;
  const Following own = following(columns, {});
  Following best;
  const ColumnWay* found = nullptr;
  for (const ColumnWay& way : ways) {
    const Following other = following(columns, way);
    if (other.known < kFewestLit || other.share() <= best.share()) continue;
    best = other, found = &way;
  }
  if (found == nullptr || best.share() < kMost || best.share() < kBetter * own.share()) return std::nullopt;
  if (found->order.late == 0 && !one_way(columns, *found)) return std::nullopt;
  LightFault fault{
      fmt::format("of pixels that are lit alone, {:.0f} % are bright in their own photograph, and "
                  "{:.0f} % in that of another pixel, always in the same order",
                  100 * own.share(), 100 * best.share()),
      {cause_of(*found)}};
  if (found->order.late != 0 && found->order.turn != Turn::none)
    fault.causes.push_back(cause_of_turn(found->order.turn));
  return fault;
}

/// In how many photographs a lit pixel is bright, in the median.
double bright_in(const LightColumns& columns) {
  std::vector<double> counts;
  for (std::size_t row = 0; row < columns.size(); ++row) {
    if (!columns.lit(row)) continue;
    double count = 0;
    for (std::size_t col = 0; col < columns.size(); ++col)
      count += columns.light(row, col) > kOwnLight * columns.most(row) ? 1 : 0;
    counts.push_back(count);
  }
  return median(counts);
}

/// Each pixel is bright in few photographs, mostly not its own, in no known way, and no light goes back.
Found find_other_pixels(const LightColumns& columns) {
  constexpr double kMost = 0.5, kFewPhotographs = 4;
  const Following own = following(columns, {});
  const std::size_t one_way = columns.photographs_of_one_way();
  if (own.known < kFewestLit || own.share() > kMost ||
      static_cast<double>(one_way) < kMost * static_cast<double>(own.known) ||
      bright_in(columns) > kFewPhotographs)
    return std::nullopt;
  return LightFault{fmt::format("of pixels that are lit alone, {:.0f} % are bright in their own photograph; "
                                "{} photographs hold bright light from which none goes back",
                                100 * own.share(), one_way),
                    causes_of_other_pixels()};
}

/// From one photograph on, all follow another way.
Found find_change(const LightColumns& columns, const std::vector<ColumnWay>& ways) {
  constexpr double kAll = 0.8;
  for (std::size_t first = 1; first < columns.size(); ++first) {
    if (columns.follows({}, first).value_or(true)) continue;
    const Following after = following(columns, {}, first);
    if (after.known < kFewestLit || after.share() > 1 - kAll) continue;
    for (const ColumnWay& way : ways) {
      const Following other = following(columns, way, first);
      if (other.known < kFewestLit || other.share() < kAll) continue;
      LightFault fault{
          fmt::format("from photograph {} on, {:.0f} % of the pixels that are lit alone are bright "
                      "in their own photograph, and {:.0f} % in that of another pixel, always in "
                      "the same order",
                      first + 1, 100 * after.share(), 100 * other.share()),
          {cause_of(way)}};
      if (way.order.right())
        fault.causes.front() = {"the camera or the projector has moved", "fasten it, and capture again"};
      return fault;
    }
    return std::nullopt;  // later ones have even fewer photographs
  }
  return std::nullopt;
}

/// Light of the pixel that was lit before, less the light back.
struct Before {
  double light = 0, excess = 0, own = 0;
};
std::optional<Before> before(const LightColumns& columns, std::size_t col) {
  if (col == 0 || !columns.lit(col - 1)) return std::nullopt;
  const double there = columns.light(col - 1, col);
  return Before{there, there - columns.light(col, col - 1), columns.light(col - 1, col - 1)};
}

Found find_late_photograph(const LightColumns& columns) {
  // Where much light goes one way only, T is not symmetric: that is a rig that is not coaxial.
  constexpr std::size_t kOneOf = 50;
  if (columns.photographs_of_one_way() > std::max<std::size_t>(1, columns.size() / kOneOf))
    return std::nullopt;
  for (std::size_t col = 1; col < columns.size(); ++col) {
    const auto kept = before(columns, col);
    if (!kept || kept->light < kOwnLight * columns.most(col - 1) ||
        kept->light - kept->excess > kNotBack * kept->light ||
        columns.light(col, col) > kNotBack * kept->light)
      continue;
    return LightFault{
        fmt::format("photograph {} of a single pixel shows the pixel of photograph {} ({}): {} of its light, "
                    "and {} goes the other way",
                    col + 1, col, columns.name(col - 1),
                    percent_of_light(kept->light / columns.most(col - 1)),
                    percent_of_light((kept->light - kept->excess) / columns.most(col - 1))),
        {late_frame()}};
  }
  return std::nullopt;
}

Found find_glow(const LightColumns& columns) {
  constexpr double kLeast = 0.01, kSure = 8;
  LightMean glow;
  for (std::size_t col = 1; col < columns.size(); ++col)
    if (const auto kept = before(columns, col); kept && kept->own > 0) glow.add(kept->excess / kept->own);
  if (glow.count < kFewestLit || glow.mean() < kLeast ||
      glow.mean() < kSure * std::sqrt(glow.variance_of_mean()))
    return std::nullopt;
  return afterglow(glow.mean());
}

/// Photographs of one pixel that hold light nearly everywhere but there.
Found find_inverted(const LightColumns& columns) {
  constexpr double kMost = 0.8;
  std::size_t lit = 0, darkest = 0;
  for (std::size_t row = 0; row < columns.size(); ++row) {
    if (!columns.lit(row)) continue;
    ++lit;
    const double own = columns.light(row, row);
    if (own > kOwnLight * columns.most(row) + (1 - kOwnLight) * columns.least(row)) continue;
    std::vector<double> others;
    for (std::size_t col = 0; col < columns.size(); ++col)
      if (col != row) others.push_back(columns.light(row, col));
    if (std::ranges::min(others) > own && median(others) > kOwnLight * columns.most(row)) ++darkest;
  }
  if (lit < kFewestLit || static_cast<double>(darkest) < kMost * static_cast<double>(lit))
    return std::nullopt;
  return LightFault{
      fmt::format("of {} pixels that are lit alone, {} are darkest in their own photograph, and "
                  "bright in the others",
                  lit, darkest),
      {cause_of_order({0, true, Turn::none})}};
}

/// Pixels that do not depend on what is lit: a few are stuck, and most are light that no pattern changes.
Found find_constant_pixels(const LightColumns& columns) {
  constexpr double kConstant = 0.8;
  std::vector<std::size_t> found;
  bool equal = true;
  for (std::size_t row = 0; row < columns.size(); ++row) {
    if (!columns.lit(row) || columns.least(row) <= kConstant * columns.most(row)) continue;
    found.push_back(row);
    equal = equal && columns.least(row) == columns.most(row);
  }
  if (found.empty()) return std::nullopt;
  LightFault fault{
      fmt::format("{} of {} pixels {} the same light whichever pixel is lit, the first one at {}",
                  found.size(), columns.size(), found.size() == 1 ? "has" : "have",
                  columns.name(found.front())),
      {stuck_pixels()}};
  if (2 * found.size() > columns.size()) fault.causes = causes_of_constant_light(equal);
  return fault;
}

/// Light beside the lit pixel that is below that of nearly all pixels farther away. Below the most of them is
/// no fault: a plane that faces another lights that, and not itself.
Found find_negative_light(const LightColumns& columns) {
  constexpr double kShare = 2e-3, kSure = 6, kDarkest = 0.1;
  const Grid grid = columns.grid();
  LightMean less;
  std::vector<double> far;
  for (std::size_t col = 0; col < columns.size(); ++col) {
    const auto [r, c] = columns.place(col);
    const double own = columns.light(col, col);
    if (!columns.lit(col) || own <= 0 || r == 0 || c == 0 || r + 1 == grid.rows || c + 1 == grid.cols)
      continue;
    double near = 0;
    for (const auto [dr, dc] : {std::array{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
      near += columns.light(columns.pixel(r + dr, c + dc), col);
    far.clear();
    for (int row = std::max(0, r - 3); row < std::min(grid.rows, r + 4); ++row)
      for (int at = std::max(0, c - 3); at < std::min(grid.cols, c + 4); ++at)
        if (std::abs(row - r) + std::abs(at - c) > 2)
          far.push_back(columns.light(columns.pixel(row, at), col));
    if (!far.empty()) less.add((quantile(far, kDarkest) - near / 4) / own);
  }
  if (less.count < kFewestLit || less.mean() < kShare ||
      less.mean() < kSure * std::sqrt(less.variance_of_mean()))
    return std::nullopt;
  return sharpening(less.mean());
}

}  // namespace

Result<void> check_order_of_columns(const TransportTensor& measured, const LightSeries& series) {
  if (!exchanged_light(series).significant) return {};
  const LightColumns columns(measured);
  if (const Found other = find_other_pixels(columns)) return other->error();
  return {};
}

Result<void> check_columns(const TransportTensor& measured) {
  const LightColumns columns(measured);
  if (const Found inverted = find_inverted(columns)) return inverted->error();
  if (const Found constant = find_constant_pixels(columns)) return constant->error();
  const std::vector<ColumnWay> ways = all_ways(columns.grid());
  if (const Found way = find_way(columns, ways)) return way->error();
  if (const Found change = find_change(columns, ways)) return change->error();
  if (const Found late = find_late_photograph(columns)) return late->error();
  if (const Found glow = find_glow(columns)) return glow->error();
  if (const Found negative = find_negative_light(columns)) return negative->error();
  return {};
}

}  // namespace symrig::acquisition
