// SPDX-License-Identifier: Apache-2.0
#include "calibration/pixel_map/raw_map.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// A plane has three unknowns for each axis; twice as many neighbours must agree with it.
constexpr float kFewestAgreeing = 6;
/// Vectors of pixels may end this far behind a row.
constexpr int kBehind = 16;

/// Positions of one axis with a border of NaN, and NaN where nothing is decoded.
Image<float> padded(const RawMap& map, std::size_t axis) {
  const Grid grid = map.grid();
  Image<float> out({grid.rows + 2 * kSupportReach, grid.cols + 2 * kSupportReach + kBehind}, 1,
                   std::numeric_limits<float>::quiet_NaN());
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col)
      if (map.mask.at(row, col))
        out.at(row + kSupportReach, col + kSupportReach) = map.position[axis].at(row, col);
  });
  return out;
}

}  // namespace

void drop_unsupported(RawMap& map, const DecodePolicy& policy) {
  const Grid grid = map.grid();
  const Image<float> col = padded(map, 0), row = padded(map, 1);
  const auto farthest = static_cast<float>(policy.support_distance * policy.support_distance);
  const auto share = static_cast<float>(policy.support_share);
  tbb::parallel_for(tbb::blocked_range<int>(0, grid.rows), [&](const tbb::blocked_range<int>& range) {
    std::vector<PixelSupport> support(static_cast<std::size_t>(grid.cols));
    for (int r = range.begin(); r != range.end(); ++r) {
      const auto first =
          static_cast<std::size_t>(r + kSupportReach) * static_cast<std::size_t>(col.grid().cols) +
          std::size_t{kSupportReach};
      count_support(col.values().data() + first, row.values().data() + first, col.grid().cols, support.size(),
                    farthest, support.data());
      for (int c = 0; c < grid.cols; ++c) {
        const PixelSupport& s = support[static_cast<std::size_t>(c)];
        if (s.agreeing < kFewestAgreeing || s.agreeing < share * s.decoded) map.mask.at(r, c) = 0;
      }
    }
  });
}

namespace {

/// [projector pixels] Blurred light of the border's pixels, seen from beyond it, spells a position within
/// this distance of the border: the mean of a Gaussian's tail is less than two sigmas from where it is cut.
constexpr float kBand = 2.5F;

bool in_band(float position, int size) {
  return position < kBand - 0.5F || position > static_cast<float>(size) - kBand - 0.5F;
}

/// Whether positions further inside predict the pixel's own one.
bool predicted_from_inside(const RawMap& map, std::size_t axis, int size, int row, int col,
                           const Neighbourhood& hood, double distance) {
  const auto& position = map.position[axis];
  const float own = position.at(row, col);
  const PositionPlane plane = fit_plane(position, map.mask, row, col, static_cast<double>(own), hood,
                                        [&](int r, int c) { return !in_band(position.at(r, c), size); });
  return plane.support > 0 && std::abs(plane.value - static_cast<double>(own)) <= distance;
}

}  // namespace

void drop_beyond_border(RawMap& map, const GrayCode& code, double distance) {
  const Grid grid = map.grid();
  const double scale = typical_scale(map);
  const int spacing = std::max(1, static_cast<int>(std::lround(1 / scale)));
  const Neighbourhood hood{.reach = 5, .spacing = spacing, .scale = scale, .least = 6};
  Image<std::uint8_t> kept = map.mask;
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col) {
      if (!map.mask.at(row, col)) continue;
      for (const StripeAxis which : {StripeAxis::columns, StripeAxis::rows}) {
        if (code.bits(which) == 0) continue;
        const std::size_t axis = axis_index(which);
        const int size = which == StripeAxis::columns ? code.projector().cols : code.projector().rows;
        if (in_band(map.position[axis].at(row, col), size) &&
            !predicted_from_inside(map, axis, size, row, col, hood, distance))
          kept.at(row, col) = 0;
      }
    }
  });
  map.mask = std::move(kept);
}

namespace {

/// Median of the decoded positions of one axis in the 5 × 5 pixels around (row, col): the starting value of a
/// pixel that was not decoded.
std::optional<double> median_around(const Image<float>& position, const Image<std::uint8_t>& mask, int row,
                                    int col) {
  std::array<float, 25> values{};
  std::size_t count = 0;
  const Grid grid = mask.grid();
  for (int r = std::max(row - 2, 0); r <= std::min(row + 2, grid.rows - 1); ++r)
    for (int c = std::max(col - 2, 0); c <= std::min(col + 2, grid.cols - 1); ++c)
      if (mask.at(r, c)) values[count++] = position.at(r, c);
  if (count < 13) return std::nullopt;  // fewer than half are decoded: the hole is not small
  return static_cast<double>(median(std::span(values).first(count)));
}

/// The refined position of one axis; nullopt where the neighbourhood does not support the pixel.
std::optional<float> refined(const RawMap& map, std::size_t axis, int row, int col,
                             const Neighbourhood& hood) {
  const auto& position = map.position[axis];
  const auto centre = map.mask.at(row, col) ? static_cast<double>(position.at(row, col))
                                            : median_around(position, map.mask, row, col);
  if (!centre) return std::nullopt;
  const PositionPlane plane =
      fit_plane(position, map.mask, row, col, *centre, hood, [](int, int) { return true; });
  // A pixel further than one step from the plane of its neighbours was decoded wrongly.
  if (plane.support == 0 || std::abs(plane.value - *centre) > hood.largest_step(1)) return std::nullopt;
  return static_cast<float>(plane.value);
}

}  // namespace

void refine(RawMap& map, const Image<std::uint8_t>& lit) {
  const Grid grid = map.grid();
  // 7 × 7 pixels: rounding to whole positions (rms 0.29 px) falls to about 0.05 px; half of them must agree.
  const Neighbourhood hood{.reach = 3, .spacing = 1, .scale = typical_scale(map), .least = 25};
  RawMap out{{Image<float>(grid), Image<float>(grid)}, Image<std::uint8_t>(grid)};
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col) {
      if (!lit.at(row, col)) continue;
      const auto x = refined(map, 0, row, col, hood), y = refined(map, 1, row, col, hood);
      if (!x || !y) continue;
      out.position[0].at(row, col) = *x;
      out.position[1].at(row, col) = *y;
      out.mask.at(row, col) = 1;
    }
  });
  map = std::move(out);
}

namespace {

/// Median position of the masked pixels of the neighbourhood.
std::optional<double> median_of(const Image<float>& position, const Image<std::uint8_t>& mask, int row,
                                int col, const Neighbourhood& hood) {
  const Grid grid = mask.grid();
  std::vector<float> values;
  for (int i = -hood.reach; i <= hood.reach; ++i) {
    for (int j = -hood.reach; j <= hood.reach; ++j) {
      const int r = row + i * hood.spacing, c = col + j * hood.spacing;
      if (r >= 0 && r < grid.rows && c >= 0 && c < grid.cols && mask.at(r, c))
        values.push_back(position.at(r, c));
    }
  }
  if (static_cast<int>(values.size()) < hood.least) return std::nullopt;
  return static_cast<double>(median(values));
}

std::optional<float> foretold(const RawMap& map, std::size_t axis, int row, int col,
                              const Neighbourhood& hood) {
  const auto centre = median_of(map.position[axis], map.mask, row, col, hood);
  if (!centre) return std::nullopt;
  const PositionPlane plane =
      fit_plane(map.position[axis], map.mask, row, col, *centre, hood, [](int, int) { return true; });
  if (plane.support == 0) return std::nullopt;
  return static_cast<float>(plane.value);
}

/// One pass over all holes. New positions are used from the next pass on.
void fill_once(RawMap& map, const Image<std::uint8_t>& wanted, const Neighbourhood& hood) {
  RawMap filled = map;
  tbb::parallel_for(0, map.grid().rows, [&](int row) {
    for (int col = 0; col < map.grid().cols; ++col) {
      if (map.mask.at(row, col) || !wanted.at(row, col)) continue;
      const auto x = foretold(map, 0, row, col, hood), y = foretold(map, 1, row, col, hood);
      if (!x || !y) continue;
      filled.position[0].at(row, col) = *x;
      filled.position[1].at(row, col) = *y;
      filled.mask.at(row, col) = 1;
    }
  });
  map = std::move(filled);
}

}  // namespace

void fill_holes(RawMap& map, const Image<std::uint8_t>& wanted) {
  const double scale = typical_scale(map);
  for (int spacing = 2; spacing <= 16; spacing *= 2)
    fill_once(map, wanted, {.reach = 3, .spacing = spacing, .scale = scale, .least = 12});
}

namespace {

/// Scatter over stated deviation of one window, and the clarity where it begins.
struct Scatter {
  float clarity = 0;
  double ratio = 0;
};

/// Four pixels of a line, `apart` pixels from one to the next.
struct Window {
  int apart = 1;
  bool down = false;  ///< along a column of the picture, not a row
};

/// The third difference of positions, over its deviation if errors are independent. A surface that bends like
/// a parabola has none.
std::optional<double> ratio_at(const Image<float>& sigma, const RawMap& map, const Image<float>& position,
                               int row, int col, Window window) {
  constexpr std::array<double, 4> kWeights{1, -3, 3, -1};
  double sum = 0, variance = 0;
  for (int k = 0; k < std::ssize(kWeights); ++k) {
    const int r = row + (window.down ? k * window.apart : 0), c = col + (window.down ? 0 : k * window.apart);
    if (!map.mask.at(r, c)) return std::nullopt;
    sum += kWeights[k] * static_cast<double>(position.at(r, c));
    variance += std::pow(kWeights[k] * static_cast<double>(sigma.at(r, c)), 2);
  }
  if (!(variance > 0)) return std::nullopt;
  return sum / std::sqrt(variance);
}

std::vector<Scatter> scatter_of(const Image<float>& sigma, const RawMap& map, StripeAxis axis,
                                const Image<float>& clarity, Window window) {
  constexpr double kMost = 40'000;
  const Grid grid = map.grid();
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(grid.size()) / kMost)));
  const int length = 3 * window.apart, rows = grid.rows - (window.down ? length : 0),
            cols = grid.cols - (window.down ? 0 : length);
  std::vector<Scatter> all;
  for (int row = 0; row < rows; row += stride)
    for (int col = 0; col < cols; col += stride)
      if (const auto ratio = ratio_at(sigma, map, map.position[axis_index(axis)], row, col, window))
        all.push_back({clarity.at(row, col), *ratio});
  return all;
}

/// The factor as a function of the clarity: linear in its logarithm between the groups.
class Factor {
 public:
  static constexpr std::size_t kGroups = 4;

  /// all: of one kind of window. Of several kinds, the mean of the squares counts.
  void add(std::vector<Scatter> all) {
    constexpr std::size_t kLeast = 200;
    if (all.size() < kLeast) return;
    std::ranges::sort(all, {}, &Scatter::clarity);
    points_.resize(kGroups);
    ++kinds_;
    for (std::size_t group = 0; group < kGroups; ++group) {
      const std::size_t begin = group * all.size() / kGroups, end = (group + 1) * all.size() / kGroups;
      std::vector<double> ratios;
      for (std::size_t k = begin; k < end; ++k) ratios.push_back(all[k].ratio);
      Point& point = points_[group];
      point.at = log_of(all[(begin + end) / 2].clarity);
      point.square += (std::pow(robust_sigma(ratios, 0), 2) - point.square) / kinds_;
    }
  }
  /// The larger of two factors stays.
  void raise_to(const Factor& other) {
    if (points_.empty()) *this = other;
    for (std::size_t group = 0; group < other.points_.size(); ++group)
      points_[group].square = std::max(points_[group].square, other.points_[group].square);
  }

  bool known() const {
    // Exact positions, as in a picture without noise, say nothing about a deviation.
    return !points_.empty() && std::ranges::all_of(points_, [](const Point& p) { return p.square > 0; });
  }
  float operator()(float clarity) const {
    const double at = log_of(clarity);
    for (std::size_t k = 0; k + 1 < points_.size(); ++k) {
      const Point &low = points_[k], &high = points_[k + 1];
      if (at >= high.at && k + 2 < points_.size()) continue;
      const double share = high.at > low.at ? std::clamp((at - low.at) / (high.at - low.at), 0.0, 1.0) : 0;
      return static_cast<float>(std::lerp(std::sqrt(low.square), std::sqrt(high.square), share));
    }
    return 1;
  }

 private:
  struct Point {
    double at = 0, square = 0;
  };
  static double log_of(float clarity) { return std::log(std::max(static_cast<double>(clarity), 1e-6)); }

  std::vector<Point> points_;
  int kinds_ = 0;
};

}  // namespace

void scale_to_scatter(Image<float>& sigma, const RawMap& map, StripeAxis axis, const Image<float>& clarity) {
  Factor factor;
  for (const bool down : {false, true}) {
    Factor along;
    for (const int apart : {1, 2}) along.add(scatter_of(sigma, map, axis, clarity, {apart, down}));
    factor.raise_to(along);
  }
  if (!factor.known()) return;
  for (std::size_t i = 0; i < sigma.values().size(); ++i)
    if (map.mask.values()[i]) sigma.values()[i] *= factor(clarity.values()[i]);
}

}  // namespace symrig::calibration
