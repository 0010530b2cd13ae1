// SPDX-License-Identifier: Apache-2.0

#include "sim/drawn/interreflection.hpp"

#include "sim/light/random.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::sim::drawn {

namespace {

constexpr std::uint64_t kSurfaceBits = 16;

/// The two nodes around a point of one axis.
struct Between {
  int low;
  float share;  // of the upper one
};

Between between(int point, int spacing, double offset) {
  if (spacing == 1) return {point, 0};
  const double at = (point + 0.5) / spacing + offset;
  const double low = std::floor(at);
  return {static_cast<int>(low), static_cast<float>(at - low)};
}

/// Cells of one axis: two more than the spacing needs, for offset and upper node.
int cells_along(int points, int spacing) {
  return spacing == 1 ? points : (points + spacing - 1) / spacing + 2;
}

}  // namespace

Lattice::Lattice(std::span<const SeenPoint> seen, Grid grid, int spacing, double row_offset,
                 double col_offset)
    : cells_{cells_along(grid.rows, spacing), cells_along(grid.cols, spacing)}, points_(seen.size()) {
  add_nodes(seen, parts_of(seen, grid, spacing, row_offset, col_offset));
}

std::vector<Lattice::Part> Lattice::parts_of(std::span<const SeenPoint> seen, Grid grid, int spacing,
                                             double row_offset, double col_offset) const {
  std::vector<Part> parts;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].body < 0) continue;
    const auto cols = static_cast<std::size_t>(grid.cols);
    const Between row = between(static_cast<int>(i / cols), spacing, row_offset);
    const Between col = between(static_cast<int>(i % cols), spacing, col_offset);
    for (int k = 0; k < 4; ++k) {
      const int down = k / 2, right = k % 2;
      const float weight = (down == 1 ? row.share : 1 - row.share) * (right == 1 ? col.share : 1 - col.share);
      const auto cell = static_cast<std::uint64_t>(row.low + down) * static_cast<std::uint64_t>(cells_.cols) +
                        static_cast<std::uint64_t>(col.low + right);
      if (weight > 0)
        parts.push_back({cell << kSurfaceBits | static_cast<std::uint64_t>(seen[i].surface),
                         static_cast<std::uint32_t>(i), weight});
    }
  }
  return parts;
}

void Lattice::add_nodes(std::span<const SeenPoint> seen, std::vector<Part> parts) {
  std::stable_sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.key < b.key; });
  std::vector<double> sum;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Part& part = parts[i];
    const SeenPoint& point = seen[part.point];
    if (i == 0 || parts[i - 1].key != part.key) {
      if (i > 0) points_.end_pixel();
      nodes_.push_back({static_cast<std::int64_t>(part.key >> kSurfaceBits), point.body, {}, {}});
      sum.push_back(0);
    }
    nodes_.back().at = nodes_.back().at + part.weight * point.at;
    nodes_.back().normal = nodes_.back().normal + part.weight * point.normal;
    sum.back() += part.weight;
    points_.add(part.point, part.weight);
  }
  if (!parts.empty()) points_.end_pixel();
  first_.assign(static_cast<std::size_t>(cells_.size()) + 1, nodes_.size());
  for (std::size_t k = nodes_.size(); k-- > 0;) {
    nodes_[k].at = 1 / sum[k] * nodes_[k].at;
    nodes_[k].normal = unit(nodes_[k].normal);
    first_[static_cast<std::size_t>(nodes_[k].cell)] = k;
  }
  for (std::size_t cell = first_.size() - 1; cell-- > 0;)
    first_[cell] = std::min(first_[cell], first_[cell + 1]);
}

namespace {

/// The distances of a level.
struct Range {
  int level;
  bool last;

  static double upper(int level) { return kNear * static_cast<double>(std::int64_t{1} << level); }
  /// The share of K at distance r that this level and finer ones hold.
  static double within(int level, double r) { return std::clamp(2 - r / upper(level), 0.0, 1.0); }
  double share(double r) const {
    const double here = last ? 1 : within(level, r);
    return here - (level == 0 ? 0 : within(level - 1, r));
  }
  double farthest() const { return last ? 1e9 : 2 * upper(level); }
};

/// (n · h)^(2^sharpness), h halfway between the rig and the other surface.
double lobe(const Finish& finish, const Vec& normal, const Vec& to_other) {
  double value = std::max(0.0, dot(normal, unit(kToRig + to_other)));
  for (int k = 0; k < finish.sharpness; ++k) value *= value;
  return 1 + finish.gloss * value;
}

/// A factor with mean 1: mostly small, seldom large, like light that few paths carry.
double speckle(std::uint64_t key, double spread) {
  const double u = unit_double(key);
  return 1 - spread + spread * 4 * u * u * u;
}

/// One entry of K_l, or zeros.
struct Coupling {
  float later = 0, first = 0;
};

class Coupler {
 public:
  Coupler(const Recipe& recipe, Range range) : recipe_(recipe), range_(range) {}

  Coupling between(const Node& a, const Node& b, std::uint64_t pair) const {
    if (a.body == b.body) return {};
    const Vec d = b.at - a.at;
    const double r = std::sqrt(dot(d, d)), share = range_.share(r);
    const double cosine_a = dot(a.normal, d), cosine_b = -dot(b.normal, d);
    if (!(share > 0) || cosine_a <= 0 || cosine_b <= 0) return {};
    if (!sees(recipe_, a.at, a.body, b.at, b.body)) return {};
    const double clamped = std::max(r, 1.0);  // neighbouring points of a sharp edge
    double value = share * cosine_a * cosine_b / (r * r * clamped * clamped * std::numbers::pi);
    if (recipe_.speckle > 0 && range_.level > 0)
      value *=
          speckle(combine(recipe_.key + static_cast<std::uint64_t>(range_.level), pair), recipe_.speckle);
    const Vec to_b = 1 / r * d;
    const double gloss = lobe(recipe_.bodies[a.body].finish, a.normal, to_b) *
                         lobe(recipe_.bodies[b.body].finish, b.normal, -1 * to_b);
    return {static_cast<float>(value), static_cast<float>(value * gloss)};
  }
  double farthest() const { return range_.farthest(); }

 private:
  const Recipe& recipe_;
  Range range_;
};

struct Entry {
  std::uint32_t other;
  Coupling coupling;
};

/// The partners of node a that come after it. The lattice's cells limit the search.
std::vector<Entry> partners(const Lattice& lattice, const Coupler& coupler, int spacing, std::size_t a) {
  std::vector<Entry> entries;
  const auto nodes = lattice.nodes();
  const Grid cells = lattice.cells();
  const int reach =
      static_cast<int>(std::min<double>(cells.rows + cells.cols, coupler.farthest() / spacing + 2));
  const int row = static_cast<int>(nodes[a].cell / cells.cols),
            col = static_cast<int>(nodes[a].cell % cells.cols);
  for (int r = row; r < std::min(cells.rows, row + reach + 1); ++r) {
    const int begin = std::max(0, col - reach), end = std::min(cells.cols - 1, col + reach);
    const std::size_t last = lattice.first_of(std::int64_t{r} * cells.cols + end + 1);
    for (std::size_t b = std::max(a + 1, lattice.first_of(std::int64_t{r} * cells.cols + begin)); b < last;
         ++b) {
      const Coupling coupling = coupler.between(
          nodes[a], nodes[b], combine(static_cast<std::uint64_t>(a), static_cast<std::uint64_t>(b)));
      if (coupling.later > 0) entries.push_back({static_cast<std::uint32_t>(b), coupling});
    }
  }
  return entries;
}

std::vector<std::vector<Entry>> all_partners(const Lattice& lattice, const Coupler& coupler, int spacing) {
  std::vector<std::vector<Entry>> all(lattice.nodes().size());
  tbb::parallel_for(std::size_t{0}, all.size(),
                    [&](std::size_t a) { all[a] = partners(lattice, coupler, spacing, a); });
  return all;
}

/// The longest distance between two points.
double diameter(std::span<const SeenPoint> seen) {
  Vec low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  for (const SeenPoint& point : seen) {
    if (point.body < 0) continue;
    low = {std::min(low.x, point.at.x), std::min(low.y, point.at.y), std::min(low.z, point.at.z)};
    high = {std::max(high.x, point.at.x), std::max(high.y, point.at.y), std::max(high.z, point.at.z)};
  }
  return low.x > high.x ? 0 : std::sqrt(dot(high - low, high - low));
}

/// Offsets of the lattice of a level.
double offset(const Recipe& recipe, int level, std::uint64_t axis) {
  return unit_double(combine(combine(recipe.key, 7), 2 * static_cast<std::uint64_t>(level) + axis));
}

}  // namespace

Interreflection::Interreflection(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid) {
  const double longest = diameter(seen);
  for (const Body& body : recipe.bodies) glossy_ = glossy_ || body.finish.gloss > 0;
  for (bool last = false; !last;) {
    const int level = static_cast<int>(levels_.size());
    last = 2 * Range::upper(level) >= longest;
    const int spacing = 1 << level;
    Level& made = levels_.emplace_back(Level{
        Lattice(seen, grid, spacing, offset(recipe, level, 0), offset(recipe, level, 1)), {}, {}, {}, {}});
    for (const auto& row : all_partners(made.lattice, Coupler(recipe, {level, last}), spacing)) {
      for (const Entry& entry : row) {
        made.other.push_back(entry.other);
        made.later.push_back(entry.coupling.later);
        if (glossy_) made.first.push_back(entry.coupling.first);
      }
      made.end.push_back(made.other.size());
    }
  }
  scale(seen, recipe.exchange);
}

void Interreflection::scale(std::span<const SeenPoint> seen, double exchange) {
  std::vector<float> sent(seen.size(), 0.F), received(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i].body >= 0) sent[i] = static_cast<float>(1 / seen[i].cosine);
  apply(Bounce::later, sent, received);
  const double most = *std::max_element(received.begin(), received.end());
  const auto factor = static_cast<float>(exchange * (most > kMostExchange ? kMostExchange / most : 1));
  for (Level& level : levels_) {
    for (float& value : level.later) value *= factor;
    for (float& value : level.first) value *= factor;
  }
}

void Interreflection::multiply(const Level& level, const std::vector<float>& entries,
                               std::span<const float> in, std::span<float> out) {
  std::size_t at = 0;
  for (std::size_t a = 0; a < level.end.size(); ++a) {
    float sum = 0;
    for (; at < level.end[a]; ++at) {
      const std::uint32_t b = level.other[at];
      sum += entries[at] * in[b];
      out[b] += entries[at] * in[a];
    }
    out[a] += sum;
  }
}

void Interreflection::apply(Bounce bounce, std::span<const float> in, std::span<float> out) const {
  std::fill(out.begin(), out.end(), 0.F);
  for (const Level& level : levels_) {
    const std::size_t count = level.lattice.nodes().size();
    std::vector<float> leaving(count), arriving(count, 0.F);
    level.lattice.gather(in, leaving);
    multiply(level, bounce == Bounce::first && glossy_ ? level.first : level.later, leaving, arriving);
    level.lattice.spread(arriving, out);
  }
}

}  // namespace symrig::sim::drawn
