// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/drawn/survey.hpp"
#include "sim/light/optics.hpp"

#include <cstddef>
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

/// What light goes between surfaces for: glossy lobes belong to paths rig - a - b - rig.
enum class Bounce : std::uint8_t { first, later };

/// Light between the surfaces of different bodies, K: a symmetric, non-negative operator on the points.
///
///   K = Σ_l W_l K_l W_lᵀ,  K_l[a, b] = V(a, b) cos θ_a cos θ_b / (π r²) · share_l(r) · speckle(a, b)
///
/// V: 1 if a and b see each other, by ray casting. share_l splits K by distance: Σ_l share_l = 1. The nodes
/// of level l are 2^l points apart. A level holds distances from 4 to 16 times this spacing; the first one
/// also holds all shorter ones. So shadows are soft by a quarter to a sixteenth of the distance. For the
/// first bounce, K_l also holds the glossy lobes (1 + g (n · h)^m) of both ends.
/// K is scaled by `exchange`. units: share of the light that leaves a, on a square point of surface b.
/// A point receives at most kMostExchange of the light that all points send, Σ_j K_ij / cos θ_j: if the sum
/// of point pairs in a sharp edge exceeds it, all of K is scaled down. cost: about 50 multiply-adds per
/// point. source: form factors of the radiosity equation; the split by distance of multilevel summation
/// [Hardy09].
class Interreflection {
 public:
  Interreflection(const Recipe& recipe, std::span<const SeenPoint> seen, Grid grid);

  /// out = K in.
  void apply(Bounce bounce, std::span<const float> in, std::span<float> out) const;
  bool glossy() const { return glossy_; }
  bool empty() const { return levels_.empty(); }

 private:
  /// The entries of K_l above its diagonal, row by row.
  struct Level {
    Lattice lattice;
    std::vector<std::size_t> end;
    std::vector<std::uint32_t> other;
    std::vector<float> later, first;  ///< first is empty if nothing is glossy
  };
  void scale(std::span<const SeenPoint> seen, double exchange);
  static void multiply(const Level& level, const std::vector<float>& entries, std::span<const float> in,
                       std::span<float> out);

  bool glossy_ = false;
  std::vector<Level> levels_;
};

/// Up to this distance K is exact, point by point [points].
inline constexpr double kNear = 8;
inline constexpr double kMostExchange = 0.9;

}  // namespace symrig::sim::drawn
