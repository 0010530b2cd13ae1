// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_map/camera_map_surfaces.hpp"
#include "calibration/camera_map/perspective_map.hpp"
#include "calibration/camera_map/stripe_pixels.hpp"
#include "calibration/fitting/spline_surface.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/camera_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

namespace symrig {

using calibration::blur_of_edge;
using calibration::BorderPixels;
using calibration::fit_robustly;
using calibration::PerspectiveMap;
using calibration::SeenCoordinate;
using calibration::SeenValue;
using calibration::SplineSurface;
using calibration::StripePixels;

namespace {

/// Knots along the longer side of the picture: one for about three cells, so that a crease bends the map only
/// near itself.
int intervals_for(Grid cells) {
  return std::clamp(std::max(cells.rows, cells.cols) / 3, 4, CameraMap::kMostIntervals);
}

/// Smoothness that is tried, from the smoothest: there the map is nearly one cubic polynomial.
constexpr std::array<double, 6> kSmoothing{1e3, 1e1, 1e-1, 1e-2, 1e-3, 1e-4};
/// Of the decoded cells, whose error is ± ½.
constexpr double kDecodedSmoothing = 1e1;
/// Only these balances count: the middle of an edge, where it is straight.
constexpr double kStraight = 0.6;
/// [pixels] Error of an edge by the texture inside a pixel: a pixel whose halves differ by a fifth.
constexpr double kTexture = 0.05;
constexpr int kEdgeRounds = 3, kRobustRounds = 3;
/// The variance of a coordinate whose weight PerspectiveMap takes for 1 [cells²].
constexpr double kUnit = 0.02 * 0.02;
/// [cells] Decoded cells that are farther from the perspective map belong to mirrors.
constexpr double kFarOff = 3;
/// Fewer do not tell more than the decoded cells.
constexpr std::size_t kFewestEdges = 100;

/// The width of an edge by the contrast of the finest stripes, whose period is four cells: a Gaussian of σ
/// cells leaves exp(−2 π² σ² / 4²) of it, and the slope of its edge is that of √(2π) σ. 0 for a contrast
/// above a half: there the slopes of edges tell more, and the pixels' own size counts.
double width_of_blur(double contrast) {
  constexpr double kPeriod = 4, kLeast = 1e-6;
  if (contrast > 0.5) return 0;
  const double sigma = kPeriod / std::numbers::pi * std::sqrt(-0.5 * std::log(std::max(contrast, kLeast)));
  return std::sqrt(2 * std::numbers::pi) * sigma;
}

/// Robust rms distance of values from a surface.
double distance(const SplineSurface& surface, std::span<const SeenValue> values) {
  std::vector<double> off;
  off.reserve(values.size());
  for (const SeenValue& v : values) off.push_back(std::abs(v.value - surface(v.at)));
  return 1.4826 * median(off);
}

/// Half of the values, by a lattice of blocks of pixels: neighbours share texture, so they stay together.
std::vector<SeenValue> half_of(std::span<const SeenValue> values, bool odd) {
  std::vector<SeenValue> half;
  half.reserve(values.size() / 2 + 1);
  constexpr int kBlock = 4;
  for (const SeenValue& v : values) {
    const int block = static_cast<int>(v.at.row) / kBlock + static_cast<int>(v.at.col) / kBlock;
    if ((block % 2 != 0) == odd) half.push_back(v);
  }
  return half;
}

Error too_few(std::size_t pixels, Grid camera) {
  return {ErrorCode::bad_value,
          fmt::format("only {} of {} camera pixels see the stripes", pixels, camera.size()),
          "point the camera at what the projector lights, focus both, or expose longer"};
}

}  // namespace

/// Fits the map of one channel.
class CameraMapFit {
 public:
  CameraMapFit(Grid cells, const StripePixels& pixels)
      : cells_(cells), pixels_(pixels), intervals_(intervals_for(cells)) {}

  Result<CameraLook> fit();

 private:
  struct Axis {
    StripeAxis axis;
    SplineSurface surface;
    std::vector<SeenValue> cells;    // decoded
    std::vector<SeenValue> guesses;  // where nothing is seen
    std::vector<SeenValue> edges;
    double smoothing = kSmoothing.front();
    double left_out = 0;
    double edge_width = 0, pixel_width = 0;
  };
  static double blur_of(const Axis& axis) { return blur_of_edge(axis.edge_width, axis.pixel_width); }

  Axis make(StripeAxis axis) const {
    return {axis, SplineSurface(pixels_.camera(), intervals_), {}, {}, {}, kSmoothing.front(), 0, 0, 0};
  }
  Result<void> decode(Axis& axis) const;
  void guess(Axis& rows, Axis& cols, std::vector<SeenValue> Axis::*from) const;
  static std::optional<calibration::RobustFit> fit_to(SplineSurface& surface, const Axis& axis,
                                                      std::span<const SeenValue> values, double smoothing,
                                                      int rounds) {
    constexpr double kLeastSigma = 1e-9;
    return fit_robustly(surface, values, smoothing, rounds, kLeastSigma, axis.guesses);
  }
  Result<void> refine(Axis& axis) const;
  struct Edge;

  std::size_t pixel(int row, int col) const {
    return static_cast<std::size_t>(std::int64_t{row} * pixels_.camera().cols + col);
  }
  /// The border may cross a pixel whose middle or side is here.
  static bool is_near(const BorderPixels::PointOnAxis& place) {
    return std::abs(place.here - place.border) < place.width;
  }
  static void add_inside(const BorderPixels& borders, int row, int col, std::vector<Edge>& edges);
  void add_between(const BorderPixels& borders, int row, int col, int down, int right,
                   std::vector<Edge>& edges) const;
  std::vector<SeenValue> find_edges(Axis& axis) const;
  static double best_smoothing(const Axis& axis);
  static double error_of(const Axis& axis);

  Grid cells_;
  const StripePixels& pixels_;
  int intervals_;
};

Result<void> CameraMapFit::decode(Axis& axis) const {
  axis.cells = pixels_.decoded(axis.axis);
  // The position of a pixel in its cell is unknown: the variance of a uniform distribution.
  for (SeenValue& value : axis.cells) value.weight = 12;
  if (!fit_robustly(axis.surface, axis.cells, kDecodedSmoothing, kRobustRounds))
    return too_few(axis.cells.size(), pixels_.camera());
  return {};
}

// A spline through the seen part of a picture swings in dark parts, by several cells. There the perspective
// map of the seen part is the best guess, and known to a cell: a value for each half interval, whose weight
// is less than a thousandth of that of an edge.
void CameraMapFit::guess(Axis& rows, Axis& cols, std::vector<SeenValue> Axis::*from) const {
  constexpr int kOfEach = 16;  // values of a half interval are enough
  constexpr std::size_t kFewest = 100;
  const Grid camera = pixels_.camera(), lattice = shape_lattice(camera, 2 * intervals_);
  const auto index = [&](Point at) {
    const int row = std::min(static_cast<int>(at.row * lattice.rows / camera.rows), lattice.rows - 1);
    const int col = std::min(static_cast<int>(at.col * lattice.cols / camera.cols), lattice.cols - 1);
    return std::int64_t{1} * row * lattice.cols + col;
  };
  rows.guesses.clear(), cols.guesses.clear();
  std::vector<char> known(lattice.size());
  for (const Axis* axis : {&rows, &cols})
    for (const SeenValue& cell : axis->cells) known[index(cell.at)] = 1;
  if (std::ranges::all_of(known, [](char one) { return one != 0; })) return;
  std::vector<SeenCoordinate> all;
  for (const Axis* axis : {&rows, &cols}) {
    std::vector<int> taken(lattice.size());
    for (const SeenValue& one : axis->*from)
      if (taken[index(one.at)]++ < kOfEach)
        all.push_back({one.at, axis->axis, one.value, kUnit * one.weight});
  }
  std::vector<SeenCoordinate> seen = all;
  PerspectiveMap map(camera);
  for (int round = 0; round < kRobustRounds; ++round) {
    map.fit(seen);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const Point to = map.look(all[k].at);
      const double off = all[k].value - (all[k].axis == StripeAxis::rows ? to.row : to.col);
      seen[k].weight = std::abs(off) < kFarOff ? all[k].weight : 0;
      kept += seen[k].weight > 0 ? 1 : 0;
    }
    if (kept < kFewest) return;
  }
  for (int row = 0; row < lattice.rows; ++row)
    for (int col = 0; col < lattice.cols; ++col) {
      const Point at{(row + 0.5) * camera.rows / lattice.rows, (col + 0.5) * camera.cols / lattice.cols};
      const Point to = map.look(at);
      const bool on_cells = to.row >= 0 && to.col >= 0 && to.row <= cells_.rows && to.col <= cells_.cols;
      if (known[index(at)] != 0 || !on_cells) continue;
      rows.guesses.push_back({at, to.row});
      cols.guesses.push_back({at, to.col});
    }
}

/// The place where an axis of the map crosses the border of two cells, in units of a pixel's width along that
/// axis.
struct CameraMapFit::Edge {
  Point at;
  double border, width;
  double balance, sigma;  ///< of the pixel, or the sum of two pixels that share the border
  double plain;           ///< balance without regard to the neighbours
  double off;             ///< from the border, as the map has it [widths]
};

/// A border that crosses the middle of a pixel: the pixel's balance tells where.
void CameraMapFit::add_inside(const BorderPixels& borders, int row, int col, std::vector<Edge>& edges) {
  const Point middle{row + 0.5, col + 0.5};
  const auto place = borders.place(middle);
  if (!is_near(place)) return;
  const auto balance = borders.balance(row, col, place);
  if (!balance || std::abs(balance->value) > kStraight) return;
  edges.push_back({middle, static_cast<double>(place.border), place.width, balance->value, balance->sigma,
                   balance->plain, (place.here - place.border) / place.width});
}

/// A border near the side that two pixels share: one sees almost only the near cell, the other the far one.
/// What is missing tells how far the border is from the side.
void CameraMapFit::add_between(const BorderPixels& borders, int row, int col, int down, int right,
                               std::vector<Edge>& edges) const {
  const Grid camera = pixels_.camera();
  if (row + down >= camera.rows || col + right >= camera.cols ||
      !pixels_.good(pixel(row + down, col + right)))
    return;
  const Point side{row + 0.5 + 0.5 * down, col + 0.5 + 0.5 * right};
  const auto place = borders.place(side);
  if (!is_near(place)) return;
  const auto a = borders.balance(row, col, place), b = borders.balance(row + down, col + right, place);
  if (!a || !b || a->value * b->value > 0 || std::abs(a->value) < kStraight || std::abs(b->value) < kStraight)
    return;
  edges.push_back({side, static_cast<double>(place.border), place.width, a->value + b->value,
                   std::hypot(a->sigma, b->sigma), a->plain + b->plain,
                   (place.here - place.border) / place.width});
}

/// A pixel of width w whose middle is d behind a border sees a balance of about s d / w. The slope s of a
/// picture is that of the regression of d / w, as the map has it, on the balance. So blur of the optics and
/// indirect light count.
std::vector<SeenValue> CameraMapFit::find_edges(Axis& axis) const {
  const Grid camera = pixels_.camera();
  const BorderPixels borders(axis.surface, pixels_, axis.axis, blur_of(axis));
  std::vector<std::vector<Edge>> of_row(static_cast<std::size_t>(camera.rows));
  tbb::parallel_for(0, camera.rows, [&](int row) {
    auto& edges = of_row[static_cast<std::size_t>(row)];
    for (int col = 0; col < camera.cols; ++col) {
      if (!pixels_.good(pixel(row, col))) continue;
      add_inside(borders, row, col, edges);
      add_between(borders, row, col, 0, 1, edges);
      add_between(borders, row, col, 1, 0, edges);
    }
  });
  const auto slope = [&](double Edge::*balance) {
    double products = 0, squares = 0;
    for (const auto& edges : of_row)
      for (const Edge& e : edges)
        if (std::abs(e.off) < 0.75) products += e.off * e.*balance, squares += std::pow(e.*balance, 2);
    return squares > 0 ? products / squares : 0.5;
  };
  const double per_balance = slope(&Edge::balance), per_plain = slope(&Edge::plain);
  std::vector<SeenValue> values;
  double widths = 0, pixel_widths = 0;
  for (const auto& edges : of_row)
    for (const Edge& e : edges) {
      widths += 2 * per_plain * e.width;
      pixel_widths += e.width;
      const double variance =
          std::pow(e.width, 2) * (std::pow(per_balance * e.sigma, 2) + std::pow(kTexture, 2));
      values.push_back({e.at, e.border + e.width * per_balance * e.balance, 1 / variance});
    }
  const double count = std::max(1.0, static_cast<double>(values.size()));
  axis.pixel_width = pixel_widths / count;
  axis.edge_width = std::max(widths / count, width_of_blur(pixels_.finest_contrast(axis.axis)));
  return values;
}

/// The smoothness whose map, from half of the edges, predicts the other half best.
double CameraMapFit::best_smoothing(const Axis& axis) {
  const auto known = half_of(axis.edges, false), left_out = half_of(axis.edges, true);
  double best = kSmoothing.front(), least = std::numeric_limits<double>::infinity();
  for (const double smoothing : kSmoothing) {
    SplineSurface surface = axis.surface;
    if (!fit_to(surface, axis, known, smoothing, 1)) continue;
    // A rougher map must gain more than chance gives it.
    if (const double off = distance(surface, left_out); off < 0.999 * least) best = smoothing, least = off;
  }
  return best;
}

Result<void> CameraMapFit::refine(Axis& axis) const {
  for (int round = 0; round < kEdgeRounds; ++round) {
    axis.edges = find_edges(axis);
    if (axis.edges.size() < kFewestEdges) return {};  // the decoded cells must do
    if (round > 0) axis.smoothing = best_smoothing(axis);
    const auto fit = fit_to(axis.surface, axis, axis.edges, axis.smoothing, kRobustRounds);
    if (!fit) return too_few(axis.cells.size(), pixels_.camera());
    axis.left_out = fit->left_out;
  }
  return {};
}

/// Half the rms difference of two maps, each from half of the edges, over the decoded pixels.
double CameraMapFit::error_of(const Axis& axis) {
  const auto& all = axis.edges.size() < kFewestEdges ? axis.cells : axis.edges;
  SplineSurface one = axis.surface, other = axis.surface;
  if (!fit_to(one, axis, half_of(all, false), axis.smoothing, kRobustRounds) ||
      !fit_to(other, axis, half_of(all, true), axis.smoothing, kRobustRounds))
    return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const SeenValue& cell : axis.cells) sum += std::pow(one(cell.at) - other(cell.at), 2);
  return 0.5 * std::sqrt(sum / static_cast<double>(axis.cells.size()));
}

Result<CameraLook> CameraMapFit::fit() {
  Axis rows = make(StripeAxis::rows), cols = make(StripeAxis::columns);
  for (Axis* axis : {&rows, &cols}) SYMRIG_CHECK(decode(*axis));
  guess(rows, cols, &Axis::cells);
  if (!rows.guesses.empty()) {
    for (Axis* axis : {&rows, &cols}) {
      fit_to(axis->surface, *axis, axis->cells, kDecodedSmoothing, kRobustRounds);
      SYMRIG_CHECK(refine(*axis));
    }
    if (std::min(rows.edges.size(), cols.edges.size()) >= kFewestEdges) guess(rows, cols, &Axis::edges);
  }
  for (Axis* axis : {&rows, &cols}) SYMRIG_CHECK(refine(*axis));
  CameraMap map;
  map.camera_ = pixels_.camera();
  map.error_ = std::sqrt((std::pow(error_of(rows), 2) + std::pow(error_of(cols), 2)) / 2);
  map.edges_ = static_cast<std::int64_t>(rows.edges.size() + cols.edges.size());
  map.edge_width_ = std::max(rows.edge_width, cols.edge_width);
  map.outlier_share_ = (rows.left_out + cols.left_out) / 2;
  Image<float> shares(map.camera_, 2);
  fill_shares(BorderPixels(rows.surface, pixels_, StripeAxis::rows, blur_of(rows)), map.camera_,
              shares.plane(0));
  fill_shares(BorderPixels(cols.surface, pixels_, StripeAxis::columns, blur_of(cols)), map.camera_,
              shares.plane(1));
  map.surfaces_ = std::make_shared<CameraMap::Surfaces>(
      CameraMap::Surfaces{std::move(rows.surface), std::move(cols.surface)});
  return CameraLook{std::move(map), std::move(shares)};
}

Result<std::vector<CameraLook>> fit_camera_maps(Grid cells, std::span<const Radiance> photographs) {
  const GrayCode code(cells);
  if (std::cmp_not_equal(photographs.size(), code.photographs()))
    return Error{ErrorCode::size_mismatch,
                 fmt::format("{} photographs of a Gray code for {} cells, which has {}", photographs.size(),
                             to_string(cells), code.photographs()),
                 "take one photograph of each pattern"};
  const Image<float>& first = photographs.front().mean;
  for (const Radiance& one : photographs)
    if (one.mean.grid() != first.grid() || one.mean.channels() != first.channels())
      return Error{ErrorCode::size_mismatch, "the photographs of the Gray code have several sizes",
                   "take all photographs with one camera"};
  std::vector<CameraLook> looks;
  for (int c = 0; c < first.channels(); ++c) {
    const StripePixels pixels(code, photographs, c);
    if (pixels.count_good() < 100) return too_few(pixels.count_good(), first.grid());
    SYMRIG_TRY(CameraLook look, CameraMapFit(cells, pixels).fit());
    looks.push_back(std::move(look));
  }
  return looks;
}

}  // namespace symrig
