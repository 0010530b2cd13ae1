// SPDX-License-Identifier: Apache-2.0
#include "tensor/split.hpp"

#include "symrig/base/text.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace symrig {
namespace {

constexpr std::array<std::pair<SplitOrder, std::string_view>, 5> kOrders{
    {{SplitOrder::flat, "flat"},
     {SplitOrder::views_first, "views-first"},
     {SplitOrder::views_last, "views-last"},
     {SplitOrder::all_at_once, "all-at-once"},
     {SplitOrder::compensated, "compensated"}}};

}  // namespace

std::string_view name(SplitOrder order) {
  for (const auto& [value, text] : kOrders)
    if (value == order) return text;
  return "unknown";
}

std::vector<std::string_view> split_order_names() {
  std::vector<std::string_view> names;
  names.reserve(kOrders.size());
  for (const auto& order : kOrders) names.push_back(order.second);
  return names;
}

Result<SplitOrder> parse_split_order(std::string_view text) {
  for (const auto& [value, known] : kOrders)
    if (known == text) return value;
  return Error{ErrorCode::unknown_name, "there is no split order '" + std::string(text) + "'",
               nearest_hint(text, split_order_names())};
}

namespace tensor {
namespace {

/// The half-open interval of one dimension that a block covers.
struct Interval {
  double low, high;
  double length() const { return high - low; }
};

/// Dimensions of a pixel: its place (in the tile or on the surface) and its view.
enum Dimension : std::uint8_t { place_row, place_col, view_row, view_col, dimensions };

/// A block during cutting: pixels [begin, end) of the order, and their box in the four dimensions.
struct Part {
  std::int32_t begin, end;
  std::array<Interval, dimensions> box;

  std::int32_t size() const { return end - begin; }
};

class Cutter {
 public:
  Cutter(Grid grid, const Split& split) : split_(split), order_(static_cast<std::size_t>(grid.size())) {
    std::iota(order_.begin(), order_.end(), 0);
    for (auto& of : at_) of.resize(order_.size());
    place(grid);
    const BlockTree views(Grid{split.views.rows, split.views.cols});
    view_rank_.resize(views.order().size());
    for (std::size_t rank = 0; rank < view_rank_.size(); ++rank)
      view_rank_[views.order()[rank]] = static_cast<std::int32_t>(rank);
  }

  /// Levels fit into a byte: places are within 2²⁵, so at most 25 levels cut places, 15 cut views, and 15 cut
  /// runs.
  TreeShape run() {
    std::vector<std::int8_t> boundaries(order_.size(), 0);
    std::vector<Part> parts{root()};
    for (std::int8_t level = 1; !parts.empty(); ++level) {
      std::vector<Part> next;
      for (const Part& part : parts)
        for (const Part& child : children(part, level)) {
          if (child.begin != part.begin) boundaries[child.begin] = level;
          if (child.size() > 1) next.push_back(child);
        }
      parts = std::move(next);
    }
    return {std::move(order_), std::move(boundaries)};
  }

 private:
  float at(Dimension of, std::int32_t pixel) const { return at_[of][pixel]; }

  /// Stretches tiles that differ by a pixel to one size, so that equal places are equal shares of a tile.
  void place(Grid grid) {
    const Grid tile{(grid.rows + split_.views.rows - 1) / split_.views.rows,
                    (grid.cols + split_.views.cols - 1) / split_.views.cols};
    for (std::int32_t pixel = 0; pixel < static_cast<std::int32_t>(grid.size()); ++pixel) {
      const int row = pixel / grid.cols;
      const int col = pixel % grid.cols;
      const std::size_t index = pixel;
      const View view = split_.views.view_of(grid, row, col);
      const Tile own = split_.views.tile(grid, view);
      const auto stretched = [](int offset, int from, int to) {
        return static_cast<float>((offset + 0.5) * to / from);
      };
      at_[place_row][index] = stretched(row - own.row, own.grid.rows, tile.rows);
      at_[place_col][index] = stretched(col - own.col, own.grid.cols, tile.cols);
      at_[view_row][index] = static_cast<float>(view.row) + 0.5F;
      at_[view_col][index] = static_cast<float>(view.col) + 0.5F;
      if (split_.order != SplitOrder::compensated) continue;
      at_[place_row][index] = split_.surface.plane(0)[index];
      at_[place_col][index] = split_.surface.plane(1)[index];
    }
  }

  Part root() const {
    Part all{0, static_cast<std::int32_t>(order_.size()), {}};
    for (std::size_t d = 0; d < dimensions; ++d) {
      const auto [low, high] = std::minmax_element(at_[d].begin(), at_[d].end());
      all.box[d] = {std::floor(static_cast<double>(*low)), std::floor(static_cast<double>(*high)) + 1};
    }
    return all;
  }

  static bool divides(const Part& part, Dimension one, Dimension other) {
    return part.box[one].length() > 1 || part.box[other].length() > 1;
  }

  using Plane = std::pair<Dimension, Dimension>;
  static constexpr Plane kPlaces{place_row, place_col}, kViews{view_row, view_col};
  static constexpr Plane kRows{place_row, view_row}, kCols{place_col, view_col};

  /// The two dimensions to cut, in order of preference.
  std::array<Plane, 2> planes(int level) const {
    if (split_.order == SplitOrder::views_first) return {kViews, kPlaces};
    if (split_.order == SplitOrder::all_at_once)
      return level % 2 == 1 ? std::array{kRows, kCols} : std::array{kCols, kRows};
    return {kPlaces, kPlaces};
  }

  /// At least two children of a part with more than one pixel. A cut that leaves all pixels on one side does
  /// not become a separate level. Pixels in one place are cut into equal runs: otherwise two pixels of one
  /// view in one place would cost a level.
  std::vector<Part> children(Part part, int level) {
    const auto [preferred, other] = planes(level);
    for (;;) {
      const auto [first, second] = divides(part, preferred.first, preferred.second) ? preferred : other;
      if (!divides(part, first, second)) return runs(part);
      std::vector<Part> cut;
      for (const Part& half : halves(part, first))
        for (const Part& quarter : halves(half, second)) cut.push_back(quarter);
      if (cut.size() > 1) return cut;
      part = cut.front();
    }
  }

  /// The non-empty halves along one dimension, the larger first as in the flat tree. A single step (pixel or
  /// view) is not cut.
  std::vector<Part> halves(const Part& part, Dimension along) {
    const Interval range = part.box[along];
    if (range.length() <= 1) return {part};
    const double cut = range.low + std::ceil(range.length() / 2);
    const auto first = order_.begin() + part.begin;
    const auto split = std::stable_partition(first, order_.begin() + part.end, [&](std::int32_t pixel) {
      return static_cast<double>(at(along, pixel)) < cut;
    });
    const auto at_cut = static_cast<std::int32_t>(split - order_.begin());
    std::vector<Part> out;
    const auto keep = [&](std::int32_t begin, std::int32_t end, Interval half) {
      if (begin == end) return;
      out.push_back({begin, end, part.box});
      out.back().box[along] = half;
    };
    keep(part.begin, at_cut, {range.low, cut});
    keep(at_cut, part.end, {cut, range.high});
    return out;
  }

  /// Up to four runs of equal length, with neighbouring views together.
  std::vector<Part> runs(const Part& part) {
    const auto rank = [&](std::int32_t pixel) {
      const auto row = static_cast<std::size_t>(at(view_row, pixel));
      const auto col = static_cast<std::size_t>(at(view_col, pixel));
      return view_rank_[row * static_cast<std::size_t>(split_.views.cols) + col];
    };
    std::stable_sort(order_.begin() + part.begin, order_.begin() + part.end,
                     [&](std::int32_t a, std::int32_t b) { return rank(a) < rank(b); });
    std::vector<Part> out;
    const std::int32_t count = std::min(part.size(), 4);
    for (std::int32_t k = 0; k < count; ++k) {
      const auto edge = [&](std::int64_t i) {
        return static_cast<std::int32_t>(part.begin + (i * part.size() + count - 1) / count);
      };
      out.push_back({edge(k), edge(k + 1), part.box});
    }
    return out;
  }

  const Split& split_;
  std::vector<std::int32_t> order_;
  std::array<std::vector<float>, dimensions> at_;
  std::vector<std::int32_t> view_rank_;  ///< order of each view (raster) in the quadtree of the views
};

}  // namespace

TreeShape cut_views(Grid grid, const Split& split) {
  return Cutter(grid, split).run();
}

}  // namespace tensor
}  // namespace symrig
