// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/views.hpp"

#include "calibration/camera_map/perspective_map.hpp"
#include "calibration/camera_map/stripe_pixels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <utility>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace symrig::calibration {
namespace {

/// Pixels that tell the affine map. More change nothing.
constexpr std::size_t kSample = 800;
/// So that samples of three own cells come up twenty times. With more views, the search takes seconds.
std::size_t rounds_for(std::size_t views) {
  return std::min<std::size_t>(20 * views * views * views, 200'000);
}
/// Share of the sampled pixels that must agree. A map that is a tile off has at most two thirds with three
/// views along an axis, but never more than the right one.
constexpr double kFewest = 0.5;
/// Of the smallest tile's side: how far a decoded cell may be from the map. Distortion and perspective bend
/// the right one, and a wrong one is a tile off.
constexpr double kNear = 0.25;
constexpr int kBendRounds = 4;

/// A pixel and the cells that it decodes, one for each view that lights it.
struct Candidates {
  Point at;
  std::vector<Point> cells;
};

/// An affine map from the picture to the cells.
struct Affine {
  Eigen::Matrix<double, 2, 3> m;
  Point operator()(Point at) const {
    const Eigen::Vector2d to = m * Eigen::Vector3d(at.row, at.col, 1);
    return {to[0], to[1]};
  }
};

double distance(Point a, Point b) {
  return std::hypot(a.row - b.row, a.col - b.col);
}

/// The cells that the pixels of one view's photographs decode. NaN: none.
std::array<std::vector<double>, 2> decoded(const GrayCode& code, std::span<const Radiance> photographs) {
  const int channel = photographs.front().mean.channels() / 2;
  const StripePixels pixels(code, photographs, channel);
  const Grid camera = pixels.camera();
  std::array<std::vector<double>, 2> cells;
  for (const StripeAxis axis : {StripeAxis::rows, StripeAxis::columns}) {
    auto& of_axis = cells[axis == StripeAxis::rows ? 0 : 1];
    of_axis.assign(static_cast<std::size_t>(camera.size()), std::numeric_limits<double>::quiet_NaN());
    for (const SeenValue& value : pixels.decoded(axis))
      of_axis[static_cast<std::size_t>(std::int64_t{static_cast<int>(value.at.row)} * camera.cols +
                                       static_cast<int>(value.at.col))] = value.value;
  }
  return cells;
}

/// All pixels that decode something.
std::vector<Candidates> candidates(const GrayCode& code, std::span<const std::vector<Radiance>> by_view) {
  const Grid camera = by_view.front().front().mean.grid();
  std::vector<Candidates> found(static_cast<std::size_t>(camera.size()));
  for (const auto& photographs : by_view) {
    const auto cells = decoded(code, photographs);
    for (std::size_t k = 0; k < found.size(); ++k)
      if (std::isfinite(cells[0][k]) && std::isfinite(cells[1][k]))
        found[k].cells.push_back({cells[0][k], cells[1][k]});
  }
  std::size_t pixel = 0;
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col) found[pixel++].at = {row + 0.5, col + 0.5};
  std::erase_if(found, [](const Candidates& one) { return one.cells.empty(); });
  return found;
}

/// The cell nearest to where a map looks, if there is one within reach.
template <class Map>
std::optional<Point> agrees(const Candidates& pixel, const Map& map, double reach) {
  const Point to = map(pixel.at);
  const auto nearest = std::ranges::min_element(
      pixel.cells, [&](Point a, Point b) { return distance(a, to) < distance(b, to); });
  return distance(*nearest, to) < reach ? std::optional(*nearest) : std::nullopt;
}

/// Through three pixels; nothing if they are on a line.
std::optional<Affine> affine_through(std::span<const Point, 3> at, std::span<const Point, 3> cells) {
  Eigen::Matrix3d from;
  Eigen::Matrix<double, 2, 3> to;
  for (int k = 0; k < 3; ++k) {
    from.col(k) = Eigen::Vector3d(at[k].row, at[k].col, 1);
    to.col(k) = Eigen::Vector2d(cells[k].row, cells[k].col);
  }
  // The determinant is twice the area of the triangle [pixels²].
  constexpr double kLeastArea = 100;
  if (std::abs(from.determinant()) < kLeastArea) return std::nullopt;
  return Affine{to * from.inverse()};
}

// Random sample consensus [Fischler81]. Each pixel has up to V cells, one from each view, and one of them
// is its own. A round takes three pixels and one cell of each, and counts the pixels of a sample that have
// some cell where the affine map through the three looks. Three right cells come together with probability
// V⁻³, so rounds_for(V) rounds almost surely contain them. The map that most agree with is then bent by
// perspective and distortion (`bent`).

/// The affine map that most of the pixels agree with. Generator and sample are the same on every machine.
std::optional<Affine> best_affine(std::span<const Candidates> pixels, std::size_t views, double reach) {
  std::mt19937_64 random(1);  // NOLINT(cert-msc51-cpp): the same map each time
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  std::vector<const Candidates*> sample;
  for (std::size_t k = 0; k < kSample; ++k) sample.push_back(&pixels[below(pixels.size())]);
  std::optional<Affine> best;
  std::int64_t most = 0;
  for (std::size_t round = 0; round < rounds_for(views); ++round) {
    std::array<Point, 3> at, cells;
    for (std::size_t k = 0; k < 3; ++k) {
      const Candidates& one = *sample[below(sample.size())];
      at[k] = one.at;
      cells[k] = one.cells[below(one.cells.size())];
    }
    const auto map = affine_through(at, cells);
    if (!map) continue;
    const auto count = std::ranges::count_if(
        sample, [&](const Candidates* one) { return agrees(*one, *map, reach).has_value(); });
    if (count > most) most = count, best = map;
  }
  if (static_cast<double>(most) < kFewest * static_cast<double>(sample.size())) return std::nullopt;
  return best;
}

/// The map with perspective and distortion through the cells that agree with it.
PerspectiveMap bent(std::span<const Candidates> pixels, Grid camera, const Affine& affine, double reach) {
  PerspectiveMap map(camera);
  for (int round = 0; round < kBendRounds; ++round) {
    std::vector<SeenCoordinate> seen;
    for (const Candidates& one : pixels) {
      const auto look = [&](Point at) { return round == 0 ? affine(at) : map.look(at); };
      const auto cell = agrees(one, look, reach);
      if (!cell) continue;
      seen.push_back({one.at, StripeAxis::rows, cell->row});
      seen.push_back({one.at, StripeAxis::columns, cell->col});
    }
    map.fit(seen);
  }
  return map;
}

/// 1 + the number of the view that the outline lies in; 0: none, or several.
std::uint16_t view_of(const Outline& outline, Grid cells, ViewLayout views, double margin) {
  double top = outline[0].row, bottom = top, left = outline[0].col, right = left;
  for (const Point& p : outline) {
    top = std::min(top, p.row), bottom = std::max(bottom, p.row);
    left = std::min(left, p.col), right = std::max(right, p.col);
  }
  const auto is_inside = [](double first, double last, int begin, int size, int all, double inset) {
    // Beyond the outer borders there is no other view. A pixel may look half a cell beyond them.
    constexpr double kBeyond = 0.5;
    const double from = begin == 0 ? -kBeyond : begin + inset;
    const double to = begin + size == all ? all + kBeyond : begin + size - inset;
    return first >= from && last <= to;
  };
  for (int row = 0; row < views.rows; ++row)
    for (int col = 0; col < views.cols; ++col) {
      const symrig::Tile tile = views.tile(cells, {row, col});
      if (is_inside(top, bottom, tile.row, tile.grid.rows, cells.rows, margin) &&
          is_inside(left, right, tile.col, tile.grid.cols, cells.cols, margin))
        return static_cast<std::uint16_t>(1 + row * views.cols + col);
    }
  return 0;
}

}  // namespace

Result<OwnViews> OwnViews::find(const GrayCode& code, ViewLayout views,
                                std::span<const std::vector<Radiance>> by_view) {
  const Grid cells = code.projector(), camera = by_view.front().front().mean.grid();
  const auto pixels = candidates(code, by_view);
  const double reach = kNear * std::min(cells.rows / views.rows, cells.cols / views.cols);
  const auto affine = pixels.empty() ? std::nullopt : best_affine(pixels, by_view.size(), reach);
  if (!affine)
    return Error{ErrorCode::bad_value,
                 fmt::format("the camera's {} pixels that see stripes agree on no map of the {} views",
                             pixels.size(), views.count()),
                 "check that camera and projector share an axis, and that the rig has these views"};
  const PerspectiveMap map = bent(pixels, camera, *affine, reach);
  CornerMap corners({camera.rows + 1, camera.cols + 1}, 2);
  for (int row = 0; row <= camera.rows; ++row)
    for (int col = 0; col <= camera.cols; ++col) {
      const Point to = map.look({static_cast<double>(row), static_cast<double>(col)});
      corners.at(row, col, 0) = to.row, corners.at(row, col, 1) = to.col;
    }
  // The map is good to about a cell.
  return OwnViews(cells, views, {&corners, 1}, 1);
}

OwnViews::OwnViews(Grid cells, ViewLayout views, std::span<const CornerMap> maps, double margin)
    : views_(views), own_({maps.front().grid().rows - 1, maps.front().grid().cols - 1}) {
  for (int row = 0; row < own_.grid().rows; ++row)
    for (int col = 0; col < own_.grid().cols; ++col) {
      std::uint16_t& own = own_.at(row, col);
      own = view_of(outline_of(maps.front(), row, col), cells, views, margin);
      for (const CornerMap& map : maps.subspan(1))
        if (view_of(outline_of(map, row, col), cells, views, margin) != own) own = 0;
    }
}

void OwnViews::leave_only(View view, Radiance& photograph) const {
  const int number = 1 + view.row * views_.cols + view.col;
  const auto pixels = own_.values();
  for (int c = 0; c < photograph.mean.channels(); ++c)
    for (std::size_t pixel = 0; pixel < pixels.size(); ++pixel) {
      if (pixels[pixel] == number) continue;
      photograph.mean.plane(c)[pixel] = 0;
      photograph.variance.plane(c)[pixel] = 0;
      photograph.valid.plane(c)[pixel] = 0;
    }
}

Radiance OwnViews::compose(std::span<const Radiance> by_view) const {
  Radiance all = by_view.front();
  const auto pixels = own_.values();
  for (int c = 0; c < all.mean.channels(); ++c)
    for (std::size_t pixel = 0; pixel < pixels.size(); ++pixel) {
      const Radiance* own = pixels[pixel] > 0 ? &by_view[pixels[pixel] - std::size_t{1}] : nullptr;
      all.mean.plane(c)[pixel] = own != nullptr ? own->mean.plane(c)[pixel] : 0.F;
      all.variance.plane(c)[pixel] = own != nullptr ? own->variance.plane(c)[pixel] : 0.F;
      all.valid.plane(c)[pixel] = own != nullptr ? own->valid.plane(c)[pixel] : std::uint8_t{0};
    }
  return all;
}

namespace {

symrig::Tile tile_of(Grid grid, ViewLayout views, std::size_t view) {
  const int index = static_cast<int>(view);
  return views.tile(grid, {index / views.cols, index % views.cols});
}

bool is_dark(const Pattern& pattern) {
  return std::ranges::all_of(pattern.values(), [](float v) { return v == 0; });
}

bool add_up_to(const Pattern& a, const Pattern& b, const Pattern& whole) {
  for (std::size_t i = 0; i < whole.values().size(); ++i)
    if (a.values()[i] + b.values()[i] != whole.values()[i]) return false;
  return true;
}

/// Without light, of the same pixels.
Radiance dark_like(const Radiance& one) {
  Radiance dark = one;
  std::ranges::fill(dark.mean.values(), 0.F);
  std::ranges::fill(dark.variance.values(), 0.F);
  return dark;
}

Radiance less(const Radiance& whole, const Radiance& part) {
  Radiance rest = whole;
  for (std::size_t i = 0; i < rest.mean.values().size(); ++i) {
    rest.valid.values()[i] &= part.valid.values()[i];
    const bool valid = rest.valid.values()[i] != 0;
    rest.mean.values()[i] = valid ? rest.mean.values()[i] - part.mean.values()[i] : 0.F;
    rest.variance.values()[i] = valid ? rest.variance.values()[i] + part.variance.values()[i] : 0.F;
  }
  return rest;
}

}  // namespace

Pattern inside_view(const Pattern& pattern, ViewLayout views, std::size_t view) {
  const symrig::Tile tile = tile_of(pattern.grid(), views, view);
  Pattern inside(pattern.grid());
  for (int row = tile.row; row < tile.row + tile.grid.rows; ++row)
    for (int col = tile.col; col < tile.col + tile.grid.cols; ++col)
      inside.at(row, col) = pattern.at(row, col);
  return inside;
}

ViewByView::ViewByView(Probe& rig) : rig_(rig), seen_(static_cast<std::size_t>(rig.views().count())) {}

Result<Radiance> ViewByView::photograph(const Pattern& pattern) {
  SYMRIG_TRY(auto one, rig_.measure({&pattern, 1}));
  return std::move(one.front());
}

Result<const Radiance*> ViewByView::whole_of(std::size_t view) {
  std::optional<Radiance>& whole = seen_[view].whole;
  if (!whole) {
    SYMRIG_TRY(whole, photograph(inside_view(Pattern(rig_.grid(), 1, 1.F), rig_.views(), view)));
  }
  return &*whole;
}

Result<Radiance> ViewByView::measure_view(const Pattern& pattern, std::size_t view) {
  const Pattern inside = inside_view(pattern, rig_.views(), view);
  const Pattern all = inside_view(Pattern(rig_.grid(), 1, 1.F), rig_.views(), view);
  SYMRIG_TRY(const Radiance* whole, whole_of(view));
  if (is_dark(inside)) return dark_like(*whole);
  if (std::ranges::equal(inside.values(), all.values())) return *whole;
  std::optional<Photographed>& last = seen_[view].last;
  if (last && add_up_to(inside, last->pattern, all)) return less(*whole, last->photograph);
  SYMRIG_TRY(Radiance seen, photograph(inside));
  last = Photographed{inside, seen};
  return seen;
}

Result<std::vector<Radiance>> ViewByView::measure(const Pattern& pattern) {
  std::vector<Radiance> by_view;
  by_view.reserve(views());
  for (std::size_t view = 0; view < views(); ++view) {
    SYMRIG_TRY(Radiance one, measure_view(pattern, view));
    by_view.push_back(std::move(one));
  }
  return by_view;
}

}  // namespace symrig::calibration
