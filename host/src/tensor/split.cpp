// SPDX-License-Identifier: Apache-2.0
#include "tensor/split.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

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

Result<SplitOrder> parse_split_order(std::string_view text) {
  for (const auto& [value, known] : kOrders)
    if (known == text) return value;
  return Error{ErrorCode::unknown_name, "no split order is called '" + std::string(text) + "'",
               "known: flat, views-first, views-last, all-at-once, compensated"};
}

namespace tensor {
namespace {

/// The half-open interval of one dimension that a block covers.
struct Range {
  double low, high;
  double length() const { return high - low; }
};

/// A whole number of steps is cut at the middle one, larger half first, as the flat tree does; what is one
/// step or less is cut in half.
double middle(const Range& range) {
  return range.low + (range.length() > 1 ? std::ceil(range.length() / 2) : range.length() / 2);
}

/// Dimensions of a pixel: its place (in the tile or on the surface) and its view.
enum Dimension : std::uint8_t { place_row, place_col, view_row, view_col, dimensions };

/// A block being cut: pixels [begin, end) of the order, and the box of the four dimensions they fell into.
struct Part {
  std::int32_t begin, end;
  std::array<Range, dimensions> box;

  std::int32_t size() const { return end - begin; }
};

/// Below this share of a pixel two places are one.
constexpr double kSmallestStep = 1.0 / 64;
/// Deeper than any sensible map goes; from here on, places are no longer looked at, so that levels fit a byte.
constexpr int kDeepest = 100;

class Cutter {
 public:
  Cutter(Grid grid, const Split& split) : split_(split), order_(static_cast<std::size_t>(grid.size())) {
    std::iota(order_.begin(), order_.end(), 0);
    for (auto& of : at_) of.resize(order_.size());
    place(grid);
  }

  TreeShape run() {
    std::vector<std::int8_t> boundaries(order_.size(), 0);
    std::vector<Part> parts{root()};
    for (std::int8_t level = 1; !parts.empty(); ++level) {
      std::vector<Part> next;
      for (const Part& part : parts)
        for (const Part& child : children(part, level)) {
          if (child.begin != part.begin) boundaries[static_cast<std::size_t>(child.begin)] = level;
          if (child.size() > 1) next.push_back(child);
        }
      parts = std::move(next);
    }
    return {std::move(order_), std::move(boundaries)};
  }

 private:
  float at(Dimension of, std::int32_t pixel) const { return at_[of][static_cast<std::size_t>(pixel)]; }

  /// Tiles that differ by a pixel are stretched to one size, so that equal places mean equal shares.
  void place(Grid grid) {
    const Grid tile{(grid.rows + split_.views.rows - 1) / split_.views.rows,
                    (grid.cols + split_.views.cols - 1) / split_.views.cols};
    for (std::int32_t pixel = 0; pixel < static_cast<std::int32_t>(grid.size()); ++pixel) {
      const int row = pixel / grid.cols;
      const int col = pixel % grid.cols;
      const auto index = static_cast<std::size_t>(pixel);
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

  bool views_now(const Part& part, int level) const {
    const bool several = part.box[view_row].length() > 1 || part.box[view_col].length() > 1;
    const bool wide = part.box[place_row].length() > 1 || part.box[place_col].length() > 1;
    if (!several || split_.order == SplitOrder::views_first) return several;
    return !wide || (split_.order == SplitOrder::all_at_once && level % 2 == 0);
  }

  /// At least two children of a part with more than one pixel. A cut that leaves all pixels on one side is
  /// made without becoming a level of its own.
  std::vector<Part> children(Part part, int level) {
    for (;;) {
      const bool views = views_now(part, level);
      const Dimension first = views ? view_row : place_row;
      const Dimension second = views ? view_col : place_col;
      const double step = std::max(part.box[first].length(), part.box[second].length());
      if (level > kDeepest || (!views && step < kSmallestStep)) return quarters(part);
      std::vector<Part> cut;
      for (const Part& half : halves(part, first, part.box[second]))
        for (const Part& quarter : halves(half, second, part.box[first])) cut.push_back(quarter);
      if (cut.size() > 1) return cut;
      part = cut.front();
    }
  }

  /// The non-empty halves along one dimension. One that is a step (pixel, view) long is left whole while the
  /// `other` is longer.
  std::vector<Part> halves(const Part& part, Dimension along, const Range& other) {
    const Range range = part.box[along];
    if (range.length() <= 1 && (other.length() > 1 || along == view_row || along == view_col)) return {part};
    const double cut = middle(range);
    const auto first = order_.begin() + part.begin;
    const auto split = std::stable_partition(
        first, order_.begin() + part.end,
        [&](std::int32_t pixel) { return static_cast<double>(at(along, pixel)) < cut; });
    const auto at_cut = static_cast<std::int32_t>(split - order_.begin());
    std::vector<Part> out;
    const auto keep = [&](std::int32_t begin, std::int32_t end, Range half) {
      if (begin == end) return;
      out.push_back({begin, end, part.box});
      out.back().box[along] = half;
    };
    keep(part.begin, at_cut, {range.low, cut});
    keep(at_cut, part.end, {cut, range.high});
    return out;
  }

  /// Pixels that nothing tells apart: up to four runs of them.
  static std::vector<Part> quarters(const Part& part) {
    std::vector<Part> out;
    const std::int32_t runs = std::min(part.size(), 4);
    for (std::int32_t k = 0; k < runs; ++k) {
      const auto edge = [&](std::int64_t i) {
        return static_cast<std::int32_t>(part.begin + i * part.size() / runs);
      };
      out.push_back({edge(k), edge(k + 1), part.box});
    }
    return out;
  }

  const Split& split_;
  std::vector<std::int32_t> order_;
  std::array<std::vector<float>, dimensions> at_;
};

}  // namespace

TreeShape cut_views(Grid grid, const Split& split) {
  return Cutter(grid, split).run();
}

}  // namespace tensor
}  // namespace symrig
