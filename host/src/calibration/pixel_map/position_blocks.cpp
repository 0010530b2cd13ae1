// SPDX-License-Identifier: Apache-2.0
#include "calibration/pixel_map/position_blocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Dense>
#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// Each pixel counts by what the decoder knows of both axes, so both means belong to the same point.
PositionBlock block_of(const PixelMap& map, int first_row, int first_col) {
  PositionBlock block;
  double weights = 0;
  int pixels = 0;
  for (int r = first_row; r < std::min(first_row + PositionBlock::kSide, map.camera.rows); ++r)
    for (int c = first_col; c < std::min(first_col + PositionBlock::kSide, map.camera.cols); ++c) {
      if (!map.mask.at(r, c)) continue;
      const std::array<double, 2> variance{std::pow(static_cast<double>(map.col_sigma.at(r, c)), 2),
                                           std::pow(static_cast<double>(map.row_sigma.at(r, c)), 2)};
      const double weight = 1 / (variance[0] + variance[1]);
      weights += weight, ++pixels;
      block.at.row += weight * (r + 0.5), block.at.col += weight * (c + 0.5);
      block.position[0] += weight * static_cast<double>(map.col.at(r, c));
      block.position[1] += weight * static_cast<double>(map.row.at(r, c));
      for (std::size_t axis = 0; axis < 2; ++axis) block.variance[axis] += weight * weight * variance[axis];
    }
  if (pixels < PositionBlock::kLeast) return {};
  block.decoded = true;
  block.at.row /= weights, block.at.col /= weights;
  for (double& position : block.position) position /= weights;
  for (double& variance : block.variance)
    variance = variance / (weights * weights) + PositionBlock::kCommon * PositionBlock::kCommon;
  return block;
}

constexpr int kSideReach = 4, kSideGap = 1;  // [blocks]
constexpr int kSideLeast = 6;                // on either side: twice the unknowns of a plane
/// With 18 degrees of freedom, chance gives more in 1 of 10,000 comparisons.
constexpr double kSideSigmas = 5;
/// [projector px] A smaller step is no edge: pixels where black paint meets white are off by nearly as much.
constexpr double kSideStep = 0.5;
/// [px] Rounding of positions, as scatter.
constexpr double kSideRounding = 1e-3;

/// The planes of both axes through the blocks on one side of a line.
class SidePlane {
 public:
  /// at: from the middle of the block that is judged.
  void add(const Eigen::Vector2d& at, const std::array<double, 2>& position) {
    const Eigen::Vector3d x(1, at[0], at[1]);
    const Eigen::Vector2d y(position[0], position[1]);
    a_.noalias() += x * x.transpose();
    b_.noalias() += x * y.transpose();
    squares_ += y.cwiseAbs2();
    ++count_;
  }
  int count() const { return count_; }
  /// Returns false if the blocks lie on a line.
  bool solve() {
    const Eigen::LDLT<Eigen::Matrix3d> factor(a_);
    if (!(factor.vectorD().minCoeff() > 1e-9 * factor.vectorD().maxCoeff())) return false;
    const Eigen::Matrix<double, 3, 2> x = factor.solve(b_);
    here_ = x.row(0).transpose();
    left_ = (squares_ - x.cwiseProduct(b_).colwise().sum().transpose()).cwiseMax(0);
    factor_ = factor.solve(Eigen::Vector3d::UnitX())[0];
    return true;
  }
  const Eigen::Vector2d& here() const { return here_; }  ///< the plane at the judged block
  const Eigen::Vector2d& left() const { return left_; }  ///< squares that it does not explain
  double factor() const { return factor_; }              ///< variance of here() for a scatter of 1

 private:
  Eigen::Matrix3d a_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> b_ = Eigen::Matrix<double, 3, 2>::Zero();
  Eigen::Vector2d squares_ = Eigen::Vector2d::Zero(), here_, left_;
  double factor_ = 0;
  int count_ = 0;
};

/// Compares both sides of a line through a block. across: the direction from one side to the other.
Around compare_sides(const PositionBlocks& blocks, int row, int col, int across_row, int across_col) {
  const Grid grid = blocks.grid();
  // Positions count from that of a neighbour, so that squares keep their digits.
  std::array<SidePlane, 2> side;
  const PositionBlock* origin = nullptr;
  for (int r = std::max(row - kSideReach, 0); r <= std::min(row + kSideReach, grid.rows - 1); ++r)
    for (int c = std::max(col - kSideReach, 0); c <= std::min(col + kSideReach, grid.cols - 1); ++c) {
      const int over = (r - row) * across_row + (c - col) * across_col;
      const PositionBlock& block = blocks.at(r, c);
      if (std::abs(over) <= kSideGap || !block.decoded || !PositionBlocks::is_known(r, c)) continue;
      if (!origin) origin = &block;
      const Eigen::Vector2d at(block.at.row / PositionBlock::kSide - row - 0.5,
                               block.at.col / PositionBlock::kSide - col - 0.5);
      side[over > 0].add(at,
                         {block.position[0] - origin->position[0], block.position[1] - origin->position[1]});
    }
  for (SidePlane& one : side)
    if (one.count() < kSideLeast || !one.solve()) return Around::unknown;
  const double freedom = side[0].count() + side[1].count() - 6;
  const Eigen::Vector2d scatter =
      ((side[0].left() + side[1].left()) / freedom).cwiseMax(kSideRounding * kSideRounding);
  const Eigen::Vector2d variance = scatter * (side[0].factor() + side[1].factor());
  const Eigen::Vector2d apart = side[0].here() - side[1].here();
  const Eigen::Vector2d limit = (kSideSigmas * variance.cwiseSqrt()).cwiseMax(kSideStep);
  const bool edge = (apart.cwiseAbs().array() > limit.array()).any();
  return edge ? Around::edge : Around::plane;
}

Around look_around(const PositionBlocks& blocks, int row, int col) {
  constexpr std::array<std::array<int, 2>, 4> kAcross{{{0, 1}, {1, 0}, {1, 1}, {1, -1}}};
  Around worst = Around::plane;
  for (const auto& across : kAcross) {
    const Around one = compare_sides(blocks, row, col, across[0], across[1]);
    if (one == Around::edge) return one;
    if (one == Around::unknown) worst = one;
  }
  return worst;
}

}  // namespace

PositionBlocks::PositionBlocks(const PixelMap& map)
    : grid_{(map.camera.rows + PositionBlock::kSide - 1) / PositionBlock::kSide,
            (map.camera.cols + PositionBlock::kSide - 1) / PositionBlock::kSide},
      blocks_(static_cast<std::size_t>(grid_.size())) {
  tbb::parallel_for(0, grid_.rows, [&](int row) {
    for (int col = 0; col < grid_.cols; ++col)
      blocks_[static_cast<std::size_t>(std::int64_t{row} * grid_.cols + col)] =
          block_of(map, row * PositionBlock::kSide, col * PositionBlock::kSide);
  });
}

Image<Around> find_surface_edges(const PositionBlocks& blocks) {
  Image<Around> around(blocks.grid());
  tbb::parallel_for(0, blocks.grid().rows, [&](int row) {
    for (int col = 0; col < blocks.grid().cols; ++col) around.at(row, col) = look_around(blocks, row, col);
  });
  return around;
}

Image<std::uint8_t> planar_blocks(const Image<Around>& around) {
  const Grid grid = around.grid();
  Image<std::uint8_t> planar(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) planar.at(row, col) = around.at(row, col) == Around::plane;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      if (around.at(row, col) != Around::edge) continue;
      for (int r = std::max(row - kSideReach, 0); r <= std::min(row + kSideReach, grid.rows - 1); ++r)
        for (int c = std::max(col - kSideReach, 0); c <= std::min(col + kSideReach, grid.cols - 1); ++c)
          planar.at(r, c) = 0;
    }
  return planar;
}

namespace {

using BlockList = std::vector<std::array<int, 2>>;

/// Appends the neighbours that `number` calls `wanted`, and gives them the number `as`.
void grow(Image<int>& number, BlockList& piece, std::size_t from, int wanted, int as) {
  constexpr std::array<std::array<int, 2>, 4> kSteps4{{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};
  const Grid grid = number.grid();
  for (const auto& [down, right] : kSteps4) {
    const int r = piece[from][0] + down, c = piece[from][1] + right;
    if (r < 0 || c < 0 || r >= grid.rows || c >= grid.cols || number.at(r, c) != wanted) continue;
    number.at(r, c) = as;
    piece.push_back({r, c});
  }
}

}  // namespace

MapPieces::MapPieces(const PositionBlocks& blocks, const Image<Around>& around)
    : number_(blocks.grid(), 1, kNone) {
  constexpr int kWaiting = -2;
  const Grid grid = blocks.grid();
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      if (blocks.at(row, col).decoded && around.at(row, col) != Around::edge) number_.at(row, col) = kWaiting;
  BlockList piece;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      if (number_.at(row, col) != kWaiting) continue;
      number_.at(row, col) = count_;
      piece.assign(1, {row, col});
      for (std::size_t next = 0; next < piece.size(); ++next) grow(number_, piece, next, kWaiting, count_);
      if (piece.size() >= kLeast) {
        ++count_;
        continue;
      }
      for (const auto& [r, c] : piece) number_.at(r, c) = kNone;
    }
}

}  // namespace symrig::calibration
