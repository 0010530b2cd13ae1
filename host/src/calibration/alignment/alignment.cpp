// SPDX-License-Identifier: Apache-2.0

#include "symrig/calibration/alignment.hpp"

#include "calibration/alignment/coarse_code.hpp"
#include "calibration/alignment/edge_focus.hpp"
#include "calibration/camera_map/perspective_map.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/coaxial_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig {

using calibration::CoarseCode;
using calibration::CoarseEdge;
using calibration::CoarsePixels;
using calibration::PerspectiveMap;
using calibration::SeenCoordinate;

namespace {

/// Fewer edges of an axis tell no map.
constexpr std::size_t kFewestEdges = 40;
/// Fewer edges of a border may be wrong pixels.
constexpr int kFewestOfBorder = 5;
constexpr int kRobustRounds = 3;

/// The middle of the blocks that pixels see, from the middle of the cells [cells]. none: no pixel sees any.
std::optional<Point> middle_of(const CoarsePixels& pixels, const CoarseCode& code, Grid cells) {
  double row = 0, col = 0, count = 0;
  for (int r = 0; r < pixels.camera().rows; ++r)
    for (int c = 0; c < pixels.camera().cols; ++c) {
      if (!pixels.good(r, c)) continue;
      row += pixels.block_of(r, c, StripeAxis::rows) + 0.5;
      col += pixels.block_of(r, c, StripeAxis::columns) + 0.5;
      ++count;
    }
  if (count == 0) return std::nullopt;
  return Point{row / count * code.block().rows - 0.5 * cells.rows,
               col / count * code.block().cols - 0.5 * cells.cols};
}

/// Two borders along each axis tell its scale.
bool tell_scale(std::span<const CoarseEdge> edges) {
  for (const StripeAxis axis : {StripeAxis::rows, StripeAxis::columns}) {
    std::array<int, CoarseCode::kBlocks> of_border{};
    std::size_t count = 0;
    for (const CoarseEdge& edge : edges) {
      if (edge.axis != axis) continue;
      ++of_border[static_cast<std::size_t>(edge.border)];
      ++count;
    }
    const auto borders = std::ranges::count_if(of_border, [](int n) { return n >= kFewestOfBorder; });
    if (borders < 2 || count < kFewestEdges) return false;
  }
  return true;
}

std::vector<SeenCoordinate> coordinates_of(std::span<const CoarseEdge> edges, Grid block) {
  std::vector<SeenCoordinate> seen;
  seen.reserve(edges.size());
  for (const CoarseEdge& edge : edges)
    seen.push_back(
        {edge.at, edge.axis,
         static_cast<double>(edge.border) * (edge.axis == StripeAxis::rows ? block.rows : block.cols)});
  return seen;
}

double off(const PerspectiveMap& map, const SeenCoordinate& seen) {
  const Point to = map.look(seen.at);
  return seen.value - (seen.axis == StripeAxis::rows ? to.row : to.col);
}

/// Least squares, where edges count less the farther they are from the map: Tukey's weights.
PerspectiveMap fit_robustly(Grid camera, std::vector<SeenCoordinate>& seen) {
  PerspectiveMap map(camera);
  map.fit(seen);
  for (int round = 0; round < kRobustRounds; ++round) {
    std::vector<double> sizes;
    sizes.reserve(seen.size());
    for (const SeenCoordinate& one : seen) sizes.push_back(std::abs(off(map, one)));
    const double sigma = std::max(1.4826 * median(sizes), 1e-6);
    for (SeenCoordinate& one : seen) one.weight = tukey_weight(off(map, one) / sigma);
    map.fit(seen);
  }
  return map;
}

/// What edges leave over: its mean in each part of the picture. Edges that do not belong to the map do not
/// count.
Image<float> rest_of(Grid camera, const PerspectiveMap& map, std::span<const SeenCoordinate> seen) {
  // As wide as a block, so that most parts have edges of both axes.
  const Grid lattice = shape_lattice(camera, CoarseCode::kBlocks);
  Image<double> sums(lattice, 4);
  for (const SeenCoordinate& one : seen) {
    if (one.weight == 0) continue;
    const int row =
        std::clamp(static_cast<int>(one.at.row * lattice.rows / camera.rows), 0, lattice.rows - 1);
    const int col =
        std::clamp(static_cast<int>(one.at.col * lattice.cols / camera.cols), 0, lattice.cols - 1);
    const int axis = one.axis == StripeAxis::rows ? 0 : 1;
    sums.at(row, col, axis) += off(map, one);
    sums.at(row, col, 2 + axis) += 1;
  }
  Image<float> rest(lattice, 3);
  for (int row = 0; row < lattice.rows; ++row)
    for (int col = 0; col < lattice.cols; ++col) {
      if (sums.at(row, col, 2) == 0 || sums.at(row, col, 3) == 0) continue;
      for (int k = 0; k < 2; ++k)
        rest.at(row, col, k) = static_cast<float>(sums.at(row, col, k) / sums.at(row, col, 2 + k));
      rest.at(row, col, 2) = 1;
    }
  return rest;
}

/// What the camera's pixels see of the cells, one channel.
class Census {
 public:
  Census(Grid cells, const Radiance& white, const Radiance& black, int channel)
      : white_(white), black_(black), channel_(channel), shown_(cells) {}

  /// A pixel whose middle looks at `at`. sees: it sees stripes.
  void add(int row, int col, Point at, bool sees) {
    offset_ = std::max({offset_, std::abs(at.row - row - 0.5), std::abs(at.col - col - 0.5)});
    const Grid cells = shown_.grid();
    if (!(at.row >= 0 && at.col >= 0 && at.row < cells.rows && at.col < cells.cols)) return;
    shown_.at(static_cast<int>(at.row), static_cast<int>(at.col)) = 1;
    ++on_cells_;
    if (!black_.valid.at(row, col, channel_)) return;  // defective
    if (!white_.valid.at(row, col, channel_)) {
      ++saturated_;
      return;
    }
    const auto light = static_cast<double>(white_.mean.at(row, col, channel_)) -
                       static_cast<double>(black_.mean.at(row, col, channel_));
    const double noise = std::sqrt(static_cast<double>(white_.variance.at(row, col, channel_)) +
                                   static_cast<double>(black_.variance.at(row, col, channel_)));
    if (sees)
      bright_.push_back(noise > 0 ? light / noise : kNoNoise);
    else
      ++dark_;
  }

  void tell(Alignment& alignment) {
    const double all = std::max<double>(1, static_cast<double>(on_cells_));
    alignment.dark = static_cast<double>(dark_) / all;
    alignment.saturated = static_cast<double>(saturated_) / all;
    alignment.signal_to_noise = median(bright_);
    alignment.offset = offset_;
    const auto shown = std::ranges::count(shown_.values(), std::uint8_t{1});
    alignment.cells_seen = static_cast<double>(shown) / static_cast<double>(shown_.grid().size());
  }

 private:
  /// Of a rig without noise.
  static constexpr double kNoNoise = 1e6;

  const Radiance &white_, &black_;
  int channel_;
  Image<std::uint8_t> shown_;
  std::vector<double> bright_;
  std::int64_t on_cells_ = 0, dark_ = 0, saturated_ = 0;
  double offset_ = 0;
};

/// Counts all pixels. The perspective map tells where a dark one looks, too.
void count_pixels(const PerspectiveMap& map, const CoarsePixels& pixels, const Radiance& white,
                  const Radiance& black, int channel, Alignment& alignment) {
  Census census(alignment.cells, white, black, channel);
  for (int row = 0; row < alignment.camera.rows; ++row)
    for (int col = 0; col < alignment.camera.cols; ++col)
      census.add(row, col, map.look({row + 0.5, col + 0.5}), pixels.good(row, col));
  census.tell(alignment);
}

Error too_few_cells(Grid cells) {
  return {ErrorCode::limit,
          fmt::format("{} cells are too few to align with: {} rows and columns are needed", to_string(cells),
                      CoarseCode::kFewestCells),
          "use smaller cells"};
}

bool enough(Grid cells) {
  return std::min(cells.rows, cells.cols) >= CoarseCode::kFewestCells;
}

/// Corrects the offset by the shift that the axis check finds.
Result<void> add_axis_check(Probe& rig, Alignment& found) {
  SYMRIG_TRY(const CoaxialCheck check, check_coaxial(rig));
  if (!check.rows.measured || !check.cols.measured || check.rows.beyond || check.cols.beyond) return {};
  Point& shift = found.shape.shift;
  const double row = check.rows.shift.value - shift.row, col = check.cols.shift.value - shift.col;
  shift = {check.rows.shift.value, check.cols.shift.value};
  found.offset = 0;
  for (const double r : {0.0, 0.5, 1.0})
    for (const double c : {0.0, 0.5, 1.0}) {
      const Point at{r * found.camera.rows, c * found.camera.cols}, to = found.shape.straight(at);
      found.offset =
          std::max({found.offset, std::abs(to.row + row - at.row), std::abs(to.col + col - at.col)});
    }
  return {};
}

}  // namespace

double Alignment::blur() const {
  double worst = 0;
  for (const TileFocus& tile : focus) worst = std::max(worst, tile.blur);
  return worst;
}

Result<std::vector<Pattern>> alignment_patterns(Grid cells) {
  if (!enough(cells)) return too_few_cells(cells);
  return CoarseCode(cells).patterns();
}

Result<Alignment> find_alignment(Grid cells, std::span<const Radiance> photographs) {
  if (!enough(cells)) return too_few_cells(cells);
  const CoarseCode code(cells);
  if (photographs.size() != code.black() + 1)
    return Error{
        ErrorCode::size_mismatch,
        fmt::format("{} photographs to align with, and {} are needed", photographs.size(), code.black() + 1),
        "take one photograph of each pattern"};
  Alignment found;
  found.cells = cells;
  found.camera = photographs.front().mean.grid();
  // The middle one of three channels is green, which has the most light.
  const int channel = photographs.front().mean.channels() / 2;
  const CoarsePixels pixels(code, photographs, channel);
  found.glimpse = middle_of(pixels, code, cells);
  const std::vector<CoarseEdge> edges = pixels.edges();
  if (!tell_scale(edges)) return found;
  found.seen = true;
  found.edges = static_cast<std::int64_t>(edges.size());
  std::vector<SeenCoordinate> seen = coordinates_of(edges, code.block());
  const PerspectiveMap map = fit_robustly(found.camera, seen);
  map.describe(cells, found.shape);
  found.shape.rest = rest_of(found.camera, map, seen);
  found.shape.parallax = calibration::parallax_of(found.shape.rest);
  count_pixels(map, pixels, photographs[code.white()], photographs[code.black()], channel, found);
  found.focus = calibration::EdgeFocus(code, pixels, map).measure(edges);
  return found;
}

Result<Alignment> measure_alignment(Probe& rig) {
  if (!rig.views().single())
    return Error{ErrorCode::bad_argument,
                 fmt::format("a rig of {} views cannot be aligned: a point is lit from all of them, so wide "
                             "stripes do not tell where a pixel looks",
                             rig.views().count()),
                 "align projector and camera without the mirrors; symrig calibrate takes all views"};
  SYMRIG_TRY(const std::vector<Pattern> patterns, alignment_patterns(rig.grid()));
  const std::int64_t before = rig.cost().photographs;
  SYMRIG_TRY(const std::vector<Radiance> photographs, rig.measure(patterns));
  const int channel = photographs.empty() ? 0 : photographs.front().mean.channels() / 2;
  if (auto wrong = calibration::wrong_light_of(CoarseCode(rig.grid()), photographs, channel))
    return *std::move(wrong);
  SYMRIG_TRY(Alignment found, find_alignment(rig.grid(), photographs));
  if (auto wrong = calibration::wrong_turn_of(found)) return *std::move(wrong);
  if (found.seen && !found.own_pixels()) SYMRIG_CHECK(add_axis_check(rig, found));
  found.photographs = rig.cost().photographs - before;
  return found;
}

namespace {

AlignmentFinding at_least(AlignmentGoal goal, double value, double wanted) {
  return {goal, value, wanted, value >= wanted, 0};
}

AlignmentFinding at_most(AlignmentGoal goal, double value, double wanted) {
  return {goal, value, wanted, value <= wanted, 0};
}

/// A length in cells: larger cells make it smaller.
AlignmentFinding cells_at_most(AlignmentGoal goal, double value, double wanted) {
  return {goal, value, wanted, value <= wanted, value / wanted};
}

}  // namespace

std::vector<AlignmentFinding> judge(const Alignment& a, const AlignmentGoals& goals) {
  std::vector<AlignmentFinding> findings{at_least(AlignmentGoal::stripes, a.seen ? 1 : 0, 1)};
  if (!a.seen) return findings;
  findings.push_back(at_least(AlignmentGoal::cells, a.cells_seen, goals.cells_seen));
  if (a.own_pixels()) {
    findings.push_back(at_least(AlignmentGoal::pixels, a.shape.pixels_per_cell, goals.least_pixels));
    findings.back().cell_factor = goals.least_pixels / a.shape.pixels_per_cell;
  } else {
    findings.push_back(at_most(AlignmentGoal::offset, a.offset, goals.offset));
  }
  if (a.own_pixels()) findings.push_back(cells_at_most(AlignmentGoal::focus, a.blur(), goals.blur));
  findings.push_back(cells_at_most(AlignmentGoal::parallax, a.shape.parallax.range, goals.parallax));
  findings.push_back(at_most(AlignmentGoal::saturated, a.saturated, goals.saturated));
  findings.push_back(at_least(AlignmentGoal::light, a.signal_to_noise, goals.signal_to_noise));
  return findings;
}

bool all_good(const std::vector<AlignmentFinding>& findings) {
  return std::ranges::all_of(findings, &AlignmentFinding::good);
}

double cell_factor(const std::vector<AlignmentFinding>& findings) {
  double factor = 0;
  for (const AlignmentFinding& finding : findings) factor = std::max(factor, finding.cell_factor);
  return factor;
}

}  // namespace symrig
