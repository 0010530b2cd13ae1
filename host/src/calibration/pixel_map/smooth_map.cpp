// SPDX-License-Identifier: Apache-2.0
#include "calibration/fitting/spline_surface.hpp"
#include "calibration/pixel_map/position_blocks.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/pixel_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <tbb/parallel_for.h>

namespace symrig {
namespace {

using calibration::MapPieces;
using calibration::PositionBlock;
using calibration::PositionBlocks;
using calibration::SeenValue;
using calibration::SplineSurface;

/// What is tried, from the smoothest: the distance of knots [camera pixels], and the cost of fourth
/// differences.
constexpr std::array<int, 5> kKnots{320, 160, 80, 40, 20};
constexpr std::array<double, 3> kMapSmoothing{1e0, 1e-1, 1e-2};
constexpr int kMapRounds = 1;

struct Smoothness {
  int knots;
  double smoothing;
};

/// A part of the camera's pixels.
struct Rectangle {
  int row, col;
  Grid size;
};

/// Both axes of a piece: surfaces over a rectangle around it.
class PieceSurfaces {
 public:
  PieceSurfaces(Rectangle around, int knots)
      : row_(around.row), col_(around.col), axis_{flat(around.size, knots), flat(around.size, knots)} {}

  /// column, row of the projector at a point of the camera's picture [px].
  double operator()(std::size_t axis, Point at) const { return axis_[axis]({at.row - row_, at.col - col_}); }
  /// How far a block is off, with two degrees of freedom.
  double chi2(const PositionBlock& block) const {
    double sum = 0;
    for (std::size_t axis = 0; axis < 2; ++axis)
      sum +=
          std::pow((block.position[axis] - (*this)(axis, block.at)) / sigma_[axis], 2) / block.variance[axis];
    return sum;
  }
  bool fit(std::span<const PositionBlock* const> blocks, double smoothing) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      std::vector<SeenValue> values;
      values.reserve(blocks.size());
      for (const PositionBlock* block : blocks)
        values.push_back(
            {{block->at.row - row_, block->at.col - col_}, block->position[axis], 1 / block->variance[axis]});
      const auto fit = calibration::fit_robustly(axis_[axis], values, smoothing, kMapRounds, 1);
      if (!fit) return false;
      sigma_[axis] = std::max(fit->sigma, 1.0);
    }
    return true;
  }

 private:
  static SplineSurface flat(Grid size, int knots) {
    return {size, (std::max(size.rows, size.cols) + knots - 1) / knots};
  }

  double row_, col_;
  std::array<SplineSurface, 2> axis_;
  std::array<double, 2> sigma_{1, 1};
};

/// The model of all pieces.
class PiecewiseSurfaces {
 public:
  /// Fits to the blocks where use(row, col). valid() is false if a piece has too few of them.
  template <class Use>
  PiecewiseSurfaces(const PositionBlocks& blocks, const MapPieces& pieces, Smoothness how, Use use) {
    std::vector<std::vector<const PositionBlock*>> of(static_cast<std::size_t>(pieces.count()));
    for (int row = 0; row < blocks.grid().rows; ++row)
      for (int col = 0; col < blocks.grid().cols; ++col)
        if (const int piece = pieces.at(row, col); piece >= 0 && use(row, col))
          of[static_cast<std::size_t>(piece)].push_back(&blocks.at(row, col));
    for (const auto& members : of) pieces_.emplace_back(around(members), how.knots);
    std::vector<std::uint8_t> fitted(of.size());
    tbb::parallel_for(std::size_t{0}, of.size(),
                      [&](std::size_t i) { fitted[i] = pieces_[i].fit(of[i], how.smoothing) ? 1 : 0; });
    valid_ = !fitted.empty() && std::ranges::count(fitted, 0) == 0;
  }

  bool valid() const { return valid_; }
  const PieceSurfaces& piece(int number) const { return pieces_[static_cast<std::size_t>(number)]; }

 private:
  /// Blocks near a piece may belong to it, so its rectangle reaches a little further.
  static Rectangle around(const std::vector<const PositionBlock*>& blocks) {
    constexpr int kMargin = 4 * PositionBlock::kSide;
    double top = 1e9, left = 1e9, bottom = 0, right = 0;
    for (const PositionBlock* block : blocks) {
      top = std::min(top, block->at.row), bottom = std::max(bottom, block->at.row);
      left = std::min(left, block->at.col), right = std::max(right, block->at.col);
    }
    const int row = static_cast<int>(top) - kMargin, col = static_cast<int>(left) - kMargin;
    return {row, col, {static_cast<int>(bottom) + kMargin - row, static_cast<int>(right) + kMargin - col}};
  }

  std::vector<PieceSurfaces> pieces_;
  bool valid_ = false;
};

/// Chooses the model that predicts left-out blocks best.
class SmoothnessSearch {
 public:
  SmoothnessSearch(const PositionBlocks& blocks, const MapPieces& pieces)
      : blocks_(blocks), pieces_(pieces) {}

  std::optional<Smoothness> best() {
    std::optional<Smoothness> best;
    for (const int knots : kKnots)
      if (!improves(best, {knots, 1e-1}) && best) break;
    if (!best) return best;
    const int knots = best->knots;
    for (const double smoothing : kMapSmoothing)
      if (smoothing != best->smoothing) (void)improves(best, {knots, smoothing});
    return best;
  }

 private:
  /// How far the left-out blocks are from a model, axis by axis, in units of their sigmas.
  using Off = std::array<std::vector<double>, 2>;

  /// Half of the known blocks is left out of these fits; the blocks that judge the map have no part in this.
  std::optional<Off> off_from(Smoothness how) const {
    const PiecewiseSurfaces model(blocks_, pieces_, how, [](int row, int col) {
      return PositionBlocks::is_known(row, col) && row % 2 == 0;
    });
    if (!model.valid()) return std::nullopt;
    Off off;
    for (int row = 1; row < blocks_.grid().rows; row += 2)
      for (int col = 1; col < blocks_.grid().cols; col += 2) {
        const int piece = pieces_.at(row, col);
        if (piece < 0) continue;
        const PositionBlock& block = blocks_.at(row, col);
        for (std::size_t axis = 0; axis < 2; ++axis)
          off[axis].push_back(std::abs(block.position[axis] - model.piece(piece)(axis, block.at)) /
                              std::sqrt(block.variance[axis]));
      }
    return off;
  }
  static double robust_sigma_of(std::vector<double> off) { return 1.4826 * median(off); }
  /// Whether a model is nearer than another: mean squares, where beyond three robust sigmas of the nearer one
  /// all is equally far. A rougher model must gain more than chance gives it.
  static bool is_nearer(const Off& one, const Off& other) {
    constexpr double kFarthest = 3, kGain = 0.999;
    double square = 0, other_square = 0;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double sigma = std::min(robust_sigma_of(one[axis]), robust_sigma_of(other[axis]));
      for (const double off : one[axis]) square += std::pow(std::min(off, kFarthest * sigma), 2);
      for (const double off : other[axis]) other_square += std::pow(std::min(off, kFarthest * sigma), 2);
    }
    return square < kGain * other_square;
  }
  bool improves(std::optional<Smoothness>& best, Smoothness how) {
    auto off = off_from(how);
    if (!off || (best && !is_nearer(*off, least_))) return false;
    best = how, least_ = *std::move(off);
    return true;
  }

  const PositionBlocks& blocks_;
  const MapPieces& pieces_;
  Off least_;  ///< of the best model so far
};

/// Gives each block to the piece around it whose model is nearest; kNone if all are further away than three
/// sigmas.
Image<int> assign(const PositionBlocks& blocks, const MapPieces& pieces, const PiecewiseSurfaces& model) {
  constexpr double kFar = 11.83;  // χ² of two degrees of freedom that chance exceeds in 0.27 %
  constexpr int kAround = 4;      // [blocks]
  const Grid grid = blocks.grid();
  Image<int> assigned(grid, 1, MapPieces::kNone);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int col = 0; col < grid.cols; ++col) {
      const PositionBlock& block = blocks.at(row, col);
      if (!block.decoded) continue;
      double least = kFar;
      const auto look = [&](int piece) {
        if (piece < 0 || piece == assigned.at(row, col)) return;
        if (const double chi2 = model.piece(piece).chi2(block); chi2 < least)
          least = chi2, assigned.at(row, col) = piece;
      };
      look(pieces.at(row, col));
      if (assigned.at(row, col) >= 0) continue;
      for (int r = std::max(row - kAround, 0); r <= std::min(row + kAround, grid.rows - 1); ++r)
        for (int c = std::max(col - kAround, 0); c <= std::min(col + kAround, grid.cols - 1); ++c)
          look(pieces.at(r, c));
    }
  });
  return assigned;
}

/// Clears groups of fewer than `least` blocks that touch, at their corners too.
void keep_connected(Image<std::uint8_t>& off, std::size_t least) {
  const Grid grid = off.grid();
  Image<std::uint8_t> seen(grid);
  std::vector<std::array<int, 2>> group;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      if (!off.at(row, col) || seen.at(row, col)) continue;
      group.assign(1, {row, col});
      seen.at(row, col) = 1;
      for (std::size_t next = 0; next < group.size(); ++next)
        for (int r = std::max(group[next][0] - 1, 0); r <= std::min(group[next][0] + 1, grid.rows - 1); ++r)
          for (int c = std::max(group[next][1] - 1, 0); c <= std::min(group[next][1] + 1, grid.cols - 1); ++c)
            if (off.at(r, c) && !seen.at(r, c)) seen.at(r, c) = 1, group.push_back({r, c});
      if (group.size() < least)
        for (const auto& [r, c] : group) off.at(r, c) = 0;
    }
}

/// Blocks that no model describes, in groups that are too large for chance, and blocks where two pieces meet.
Image<std::uint8_t> find_edges(const PositionBlocks& blocks, const Image<int>& assigned) {
  constexpr std::size_t kLeastGroup = 4;
  const Grid grid = blocks.grid();
  Image<std::uint8_t> off(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      off.at(row, col) = blocks.at(row, col).decoded && assigned.at(row, col) < 0 ? 1 : 0;
  keep_connected(off, kLeastGroup);
  const auto meet = [&](int row, int col, int r, int c) {
    if (r >= grid.rows || c >= grid.cols) return;
    const int here = assigned.at(row, col), there = assigned.at(r, c);
    if (here >= 0 && there >= 0 && here != there) off.at(row, col) = off.at(r, c) = 1;
  };
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) meet(row, col, row + 1, col), meet(row, col, row, col + 1);
  return off;
}

/// Positions of the model at the decoded pixels, and the marked ones.
void fill(SmoothMap& smooth, const PixelMap& map, const PiecewiseSurfaces& model, const Image<int>& assigned,
          const Image<std::uint8_t>& edges) {
  smooth.col = smooth.row = Image<float>(map.camera);
  smooth.known = smooth.edges = Image<std::uint8_t>(map.camera);
  tbb::parallel_for(0, map.camera.rows, [&](int row) {
    for (int col = 0; col < map.camera.cols; ++col) {
      if (!map.mask.at(row, col)) continue;
      const int r = row / PositionBlock::kSide, c = col / PositionBlock::kSide;
      smooth.edges.at(row, col) = edges.at(r, c);
      const int piece = assigned.at(r, c);
      if (piece < 0) continue;
      const Point at{row + 0.5, col + 0.5};
      smooth.known.at(row, col) = 1;
      smooth.col.at(row, col) = static_cast<float>(model.piece(piece)(0, at));
      smooth.row.at(row, col) = static_cast<float>(model.piece(piece)(1, at));
    }
  });
  const auto count = [](const Image<std::uint8_t>& mask) {
    return static_cast<double>(std::ranges::count(mask.values(), std::uint8_t{1}));
  };
  smooth.edge_share = count(smooth.edges) / count(map.mask);
  smooth.known_share = count(smooth.known) / count(map.mask);
}

/// How far the pixels of left-out blocks are from the model of the others.
class HeldOutSums {
 public:
  void add(double dcol, double drow) {
    const double square = dcol * dcol + drow * drow;
    ++pixels_;
    squares_ += square;
    far_ += square > SmoothMap::kFar * SmoothMap::kFar ? 1 : 0;
  }
  double pixels() const { return pixels_; }
  /// Along an axis.
  double rms() const { return pixels_ > 0 ? std::sqrt(squares_ / (2 * pixels_)) : 0; }
  double far_share() const { return pixels_ > 0 ? far_ / pixels_ : 0; }

 private:
  double pixels_ = 0, squares_ = 0, far_ = 0;
};

SmoothMap::HeldOut judge(const PixelMap& map, const MapPieces& pieces, const Image<std::uint8_t>& planar,
                         const PiecewiseSurfaces& model) {
  HeldOutSums sums;
  double all = 0;
  for (int row = 0; row < map.camera.rows; ++row)
    for (int col = 0; col < map.camera.cols; ++col) {
      const int r = row / PositionBlock::kSide, c = col / PositionBlock::kSide;
      if (!map.mask.at(row, col) || PositionBlocks::is_known(r, c)) continue;
      ++all;
      const int piece = pieces.at(r, c);
      if (!planar.at(r, c) || piece < 0) continue;
      const Point at{row + 0.5, col + 0.5};
      sums.add(static_cast<double>(map.col.at(row, col)) - model.piece(piece)(0, at),
               static_cast<double>(map.row.at(row, col)) - model.piece(piece)(1, at));
    }
  return {
      .planar_share = all > 0 ? sums.pixels() / all : 0, .rms = sums.rms(), .far_share = sums.far_share()};
}

}  // namespace

Result<SmoothMap> fit_smooth_map(const PixelMap& map) {
  SYMRIG_CHECK(require_both_axes(map, "a smooth model"));
  const Error too_few{ErrorCode::bad_value, "too few pixels are decoded for a smooth model of the map",
                      "light and focus a larger part of the picture"};
  const PositionBlocks blocks(map);
  const auto around = calibration::find_surface_edges(blocks);
  const MapPieces pieces(blocks, around);
  const auto how = SmoothnessSearch(blocks, pieces).best();
  if (!how) return too_few;
  const PiecewiseSurfaces half(blocks, pieces, *how, PositionBlocks::is_known);
  const PiecewiseSurfaces model(blocks, pieces, *how, [](int, int) { return true; });
  if (!half.valid() || !model.valid()) return too_few;
  SmoothMap smooth;
  smooth.pieces = pieces.count();
  smooth.knots = how->knots;
  smooth.smoothing = how->smoothing;
  smooth.held_out = judge(map, pieces, calibration::planar_blocks(around), half);
  const auto assigned = assign(blocks, pieces, model);
  fill(smooth, map, model, assigned, find_edges(blocks, assigned));
  return smooth;
}

}  // namespace symrig
