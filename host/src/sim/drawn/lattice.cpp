// SPDX-License-Identifier: Apache-2.0
#include "sim/drawn/lattice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

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

}  // namespace symrig::sim::drawn
