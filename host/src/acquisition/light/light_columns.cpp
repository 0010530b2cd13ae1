// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_series.hpp"
#include "acquisition/light/light_tests.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <string>
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

/// A column holds the light of a way's pixel if it has this share of the most that this pixel ever has.
constexpr double kOwnLight = 0.5;
/// Light that goes one way: that back is less than this share.
constexpr double kNotBack = 0.25;
constexpr int kFarthest = 16;  // pixels beside
constexpr std::size_t kFewestLit = 8;

/// In which way a camera may see the pixels: photograph k shows pixel k - late, turned and moved.
struct Way {
  LightOrder order;
  int down = 0, right = 0;  ///< the camera looks this far beside

  bool own() const { return order.right() && down == 0 && right == 0; }
};

/// T by its columns, all channels added; pixels in tree order.
class Columns {
 public:
  explicit Columns(const TransportTensor& measured)
      : tensor_(measured),
        grid_(measured.camera_grid()),
        pixels_(measured.camera_tree().order().size()),
        most_(pixels_.size()),
        least_(pixels_.size(), std::numeric_limits<double>::infinity()),
        entries_(pixels_.size()) {
    const auto order = tensor_.camera_tree().order();
    for (std::size_t t = 0; t < order.size(); ++t) pixels_[static_cast<std::size_t>(order[t])] = t;
    for (const SparseColumn& column : tensor_.columns())
      for (std::int64_t at = column.first; at < column.last; ++at) {
        const auto row = static_cast<std::size_t>(tensor_.column_rows()[static_cast<std::size_t>(at)]);
        most_[row] = std::max(most_[row], value(at));
        least_[row] = std::min(least_[row], value(at));
        ++entries_[row];
      }
    for (std::size_t row = 0; row < entries_.size(); ++row)
      if (entries_[row] < most_.size()) least_[row] = std::min(least_[row], 0.0);
    std::vector<double> sorted = most_;
    lit_ = kOfBright * quantile(sorted, kBright);
  }

  std::size_t size() const { return most_.size(); }
  Grid grid() const { return grid_; }
  /// Light of camera pixel `row` in photograph `col`; 0 if it was not above its noise.
  double light(std::size_t row, std::size_t col) const {
    const SparseColumn& column = tensor_.columns()[col];
    const auto rows = tensor_.column_rows().subspan(static_cast<std::size_t>(column.first),
                                                    static_cast<std::size_t>(column.last - column.first));
    const auto at = std::ranges::lower_bound(rows, static_cast<std::int32_t>(row));
    return at != rows.end() && *at == static_cast<std::int32_t>(row)
               ? value(column.first + (at - rows.begin()))
               : 0;
  }
  /// Of a pixel in all photographs.
  double most(std::size_t row) const { return most_[row]; }
  double least(std::size_t row) const { return least_[row]; }
  /// Photographs that hold light of the pixel.
  std::size_t entries(std::size_t row) const { return entries_[row]; }
  /// Photographs with strong light to which no light back belongs.
  std::size_t photographs_of_one_way() const;
  /// The pixel reflects enough light to tell something.
  bool lit(std::size_t row) const { return most_[row] > lit_ && lit_ > 0; }

  /// Row and column of a pixel, and back.
  std::array<int, 2> place(std::size_t pixel) const {
    const int raster = tensor_.camera_tree().order()[pixel];
    return {raster / grid_.cols, raster % grid_.cols};
  }
  std::size_t pixel(int row, int col) const {
    return pixels_[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.cols) +
                   static_cast<std::size_t>(col)];
  }
  /// The camera pixel that holds the light of photograph `col`; none: outside.
  std::optional<std::size_t> seen_at(const Way& way, std::size_t col) const {
    const std::int64_t shown = static_cast<std::int64_t>(col) - way.order.late;
    if (shown < 0 || shown >= static_cast<std::int64_t>(size())) return std::nullopt;
    const auto [lit_row, lit_col] = place(static_cast<std::size_t>(shown));
    const int at_row = lit_row - way.down, at_col = lit_col - way.right;
    if (at_row < 0 || at_row >= grid_.rows || at_col < 0 || at_col >= grid_.cols) return std::nullopt;
    // Where the picture is turned by a quarter, the camera sees in one sense what it shows in the other.
    const Turn turn = way.order.turn == Turn::quarter ? Turn::back
                      : way.order.turn == Turn::back  ? Turn::quarter
                                                      : way.order.turn;
    return pixels_[seen_through(turn, grid_, at_row, at_col)];
  }
  /// Whether photograph `col` holds the light of a way's pixel; none: nothing is known of this pixel.
  std::optional<bool> follows(const Way& way, std::size_t col) const {
    const auto row = seen_at(way, col);
    if (!row || !lit(*row)) return std::nullopt;
    return light(*row, col) > kOwnLight * most(*row);
  }
  std::string name(std::size_t pixel) const {
    const auto [row, col] = place(pixel);
    return fmt::format("row {}, column {}", row, col);
  }

 private:
  static constexpr double kOfBright = 0.05, kBright = 0.9;

  double value(std::int64_t entry) const {
    const auto channels = static_cast<std::size_t>(tensor_.channels());
    double sum = 0;
    for (const float v :
         tensor_.column_values().subspan(static_cast<std::size_t>(entry) * channels, channels))
      sum += static_cast<double>(v);
    return sum;
  }

  const TransportTensor& tensor_;
  Grid grid_;
  std::vector<std::size_t> pixels_;  // in tree order, of places in raster order
  std::vector<double> most_, least_;
  std::vector<std::size_t> entries_;
  double lit_ = 0;
};

std::size_t Columns::photographs_of_one_way() const {
  std::size_t found = 0;
  for (std::size_t from = 0; from < size(); ++from) {
    const SparseColumn& column = tensor_.columns()[from];
    bool strong = false;
    for (std::int64_t at = column.first; at < column.last && !strong; ++at) {
      const auto to = static_cast<std::size_t>(tensor_.column_rows()[static_cast<std::size_t>(at)]);
      strong = to != from && lit(to) && value(at) > kOwnLight * most_[to] &&
               light(from, to) < kNotBack * value(at);
    }
    found += strong ? 1 : 0;
  }
  return found;
}

std::vector<Way> all_ways(Grid grid) {
  std::vector<Way> ways;
  const int turns = grid.rows == grid.cols ? 8 : 4;
  for (int turn = 0; turn < turns; ++turn)
    for (int late = kEarliest; late <= kLatest; ++late)
      ways.push_back({{late, false, static_cast<Turn>(turn)}});
  const int rows = std::min(kFarthest, grid.rows / 2), cols = std::min(kFarthest, grid.cols / 2);
  for (int down = -rows; down <= rows; ++down)
    for (int right = -cols; right <= cols; ++right)
      if (down != 0 || right != 0) ways.push_back({{}, down, right});
  std::erase_if(ways, [](const Way& way) { return way.own(); });
  return ways;
}

struct Following {
  std::size_t known = 0, follow = 0;
  double share() const { return known > 0 ? static_cast<double>(follow) / static_cast<double>(known) : 0; }
};

/// Of the photographs from `first` on.
Following following(const Columns& columns, const Way& way, std::size_t first = 0) {
  Following found;
  for (std::size_t col = first; col < columns.size(); ++col)
    if (const auto follows = columns.follows(way, col)) ++found.known, found.follow += *follows ? 1 : 0;
  return found;
}

/// A picture that is turned or moved: as much light goes one way as the other only if the scene is the same
/// there.
bool one_way(const Columns& columns, const Way& way) {
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

LightCause cause_of(const Way& way) {
  if (way.order.right())
    return {"a camera that is not aligned with the projector, or has moved",
            "align them (symrig align), or register the camera (symrig calibrate)"};
  return way.order.late != 0 ? cause_of_order(way.order) : cause_of_turn(way.order.turn);
}

/// Most photographs follow another way than their own.
Found find_way(const Columns& columns, const std::vector<Way>& ways) {
  constexpr double kMost = 0.5, kBetter = 2;
  const Following own = following(columns, {});
  Following best;
  const Way* found = nullptr;
  for (const Way& way : ways) {
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

/// From one photograph on, all follow another way.
Found find_change(const Columns& columns, const std::vector<Way>& ways) {
  constexpr double kAll = 0.8;
  for (std::size_t first = 1; first < columns.size(); ++first) {
    if (columns.follows({}, first).value_or(true)) continue;
    const Following after = following(columns, {}, first);
    if (after.known < kFewestLit || after.share() > 1 - kAll) continue;
    for (const Way& way : ways) {
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
std::optional<Before> before(const Columns& columns, std::size_t col) {
  if (col == 0 || !columns.lit(col - 1)) return std::nullopt;
  const double there = columns.light(col - 1, col);
  return Before{there, there - columns.light(col, col - 1), columns.light(col - 1, col - 1)};
}

Found find_late_photograph(const Columns& columns) {
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

Found find_glow(const Columns& columns) {
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
Found find_inverted(const Columns& columns) {
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
Found find_constant_pixels(const Columns& columns) {
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
Found find_negative_light(const Columns& columns) {
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

/// What brute force foretells and what a photograph shows, all channels added, by pixel in tree order.
struct Compared {
  std::vector<double> foretold, seen;
};

/// shown: by pixel in tree order. plus, minus: the photographs whose difference it gives. Pixels that are not
/// valid are 0 in both.
Compared compare(const TransportTensor& measured, std::span<const float> shown, const LightSeries& series,
                 LightSeries::Place plus, std::optional<LightSeries::Place> minus) {
  const auto order = measured.camera_tree().order();
  Compared found{std::vector<double>(order.size()), std::vector<double>(order.size())};
  std::vector<float> light(order.size());
  for (int channel = 0; channel < measured.channels(); ++channel) {
    std::ranges::fill(light, 0.0F);
    measured.apply_tree(shown, light, channel, false);
    for (std::size_t t = 0; t < light.size(); ++t) found.foretold[t] += static_cast<double>(light[t]);
  }
  for (std::size_t t = 0; t < light.size(); ++t) {
    const auto at = static_cast<std::size_t>(order[t]);
    if (series.valid()[at] == 0) {
      found.foretold[t] = 0;
      continue;
    }
    found.seen[t] = static_cast<double>(series[plus].mean[at]);
    if (minus) found.seen[t] -= static_cast<double>(series[*minus].mean[at]);
  }
  return found;
}

/// A photograph of one pixel without its direct light, which the two halves show. All other light is in the
/// other photographs.
Found find_lost_photograph(const TransportTensor& measured, const LightSeries& series) {
  constexpr double kLost = 0.5;
  const Columns columns(measured);
  const LightPhotograph &half = series[LightSeries::kHalf], &other = series[LightSeries::kOtherHalf],
                        &flood = series[LightSeries::kFlood];
  const auto order = measured.camera_tree().order();
  std::vector<float> shown(order.size());
  for (std::size_t t = 0; t < shown.size(); ++t)
    shown[t] = half.lit[static_cast<std::size_t>(order[t])] != 0 ? 1 : -1;
  const Compared both = compare(measured, shown, series, LightSeries::kHalf, LightSeries::kOtherHalf);
  for (std::size_t t = 0; t < shown.size(); ++t) {
    const auto at = static_cast<std::size_t>(order[t]);
    if (series.valid()[at] == 0) continue;
    const auto light = static_cast<double>(flood.mean[at]);
    const double lacks = static_cast<double>(shown[t]) * (both.seen[t] - both.foretold[t]);
    // What is foretold has the noise of all photographs that hold some of this pixel's light.
    const double alone = std::min(static_cast<double>(series[LightSeries::kSparse].variance[at]),
                                  static_cast<double>(series[LightSeries::kOtherSparse].variance[at]));
    const double sigma =
        std::sqrt(static_cast<double>(half.variance[at]) + static_cast<double>(other.variance[at]) +
                  static_cast<double>(columns.entries(t)) * alone);
    if (light <= 0 || lacks < std::max(kLost * light, kLightSigmas * sigma) ||
        columns.light(t, t) > kNotBack * lacks)
      continue;
    return LightFault{
        fmt::format("photograph {}, of one pixel alone, lacks {} of the light that this pixel has if all "
                    "are lit",
                    t + 1, percent_of_light(lacks / light)),
        causes_of_missing_light()};
  }
  return std::nullopt;
}

}  // namespace

bool are_columns(const TransportTensor& measured) {
  const auto columns = measured.columns();
  if (measured.symmetric() || measured.camera_grid() != measured.projector_grid() ||
      measured.camera_grid().size() < kFewestPixels ||
      std::ranges::ssize(columns) != measured.camera_grid().size())
    return false;
  for (std::size_t k = 0; k < columns.size(); ++k)
    if (columns[k].col_begin != static_cast<std::int32_t>(k) ||
        columns[k].col_end != columns[k].col_begin + 1)
      return false;
  return true;
}

Result<void> check_columns(const TransportTensor& measured) {
  const Columns columns(measured);
  if (const Found inverted = find_inverted(columns)) return inverted->error();
  if (const Found constant = find_constant_pixels(columns)) return constant->error();
  const std::vector<Way> ways = all_ways(columns.grid());
  if (const Found way = find_way(columns, ways)) return way->error();
  if (const Found change = find_change(columns, ways)) return change->error();
  if (const Found late = find_late_photograph(columns)) return late->error();
  if (const Found glow = find_glow(columns)) return glow->error();
  if (const Found negative = find_negative_light(columns)) return negative->error();
  return {};
}

Result<void> check_sum_of_columns(const TransportTensor& measured, const LightSeries& series,
                                  const LookAside& look) {
  constexpr double kLeast = 0.05;
  if (const Found lost = find_lost_photograph(measured, series)) return lost->error();
  const std::vector<float> white(series.valid().size(), 1.0F);
  const Compared all = compare(measured, white, series, LightSeries::kFlood, std::nullopt);
  const double wanted = std::accumulate(all.seen.begin(), all.seen.end(), 0.0),
               together = std::accumulate(all.foretold.begin(), all.foretold.end(), 0.0);
  const double excess = wanted > 0 ? together / wanted - 1 : 0;
  if (std::abs(excess) < kLeast) return {};
  SYMRIG_TRY(const BlackAndWhite aside, look_at_black_and_white(series, look));
  if (!aside.known || std::abs(aside.black) < kLightSigmas * aside.black_sigma ||
      aside.black * static_cast<double>(white.size()) / excess < kOwnLight)
    return {};
  return LightFault{
      fmt::format("the light does not add up: the photographs of single pixels together have {}{} "
                  "of the light that all pixels give",
                  excess > 0 ? "+" : "", percent_of_light(excess)),
      {other_light(aside.black)}}
      .error();
}

}  // namespace symrig::acquisition
