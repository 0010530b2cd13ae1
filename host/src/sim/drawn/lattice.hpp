// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/drawn/survey.hpp"
#include "sim/optics.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::sim::drawn {

/// A piece of surface that stands for the points around it.
struct Node {
  std::int64_t cell = 0;  ///< of the lattice, row by row
  int body = 0;
  Vec at, normal;
};

/// Nodes on a square lattice over the picture. Each smooth surface has nodes of its own. A point belongs to
/// the four nodes around it with bilinear weights, which sum to 1.
class Lattice {
 public:
  /// spacing: of the nodes, in points; 1: each point is a node. offset: of the lattice, a share of the
  /// spacing, so that it does not lie on block boundaries.
  Lattice(std::span<const SeenPoint> seen, Grid grid, int spacing, double row_offset, double col_offset);

  std::span<const Node> nodes() const { return nodes_; }
  /// Cells of the lattice, and the first node of each cell: nodes are sorted by cell.
  Grid cells() const { return cells_; }
  std::size_t first_of(std::int64_t cell) const { return first_[static_cast<std::size_t>(cell)]; }

  /// nodes = Wᵀ points.
  void gather(std::span<const float> points, std::span<float> nodes) const { points_.see(points, nodes); }
  /// points += W nodes.
  void spread(std::span<const float> nodes, std::span<float> points) const {
    points_.add_light(nodes, points);
  }

 private:
  /// What a point has in a node.
  struct Part {
    std::uint64_t key;  // cell and surface of the node
    std::uint32_t point;
    float weight;
  };
  std::vector<Part> parts_of(std::span<const SeenPoint> seen, Grid grid, int spacing, double row_offset,
                             double col_offset) const;
  void add_nodes(std::span<const SeenPoint> seen, std::vector<Part> parts);

  Grid cells_;
  std::vector<Node> nodes_;
  std::vector<std::size_t> first_;
  Optics points_;  // Wᵀ: the points of each node
};

}  // namespace symrig::sim::drawn
