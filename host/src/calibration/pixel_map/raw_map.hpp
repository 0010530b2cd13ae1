// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Dense>

namespace symrig::calibration {

/// The working state of decoding: positions of both axes and a mask, camera grid.
struct RawMap {
  std::array<Image<float>, 2> position;  ///< [0] column, [1] row of the projector
  Image<std::uint8_t> mask;

  Grid grid() const { return mask.grid(); }
};

constexpr std::size_t axis_index(StripeAxis axis) {
  return axis == StripeAxis::columns ? 0 : 1;
}

/// A plane through the positions around one camera pixel: position ≈ value + by_col · Δcol + by_row · Δrow.
struct PositionPlane {
  double value = 0, by_col = 0, by_row = 0;
  int support = 0;  ///< number of fitted pixels; 0 = no fit
};

/// Which neighbours are used, and which belong to the same surface.
struct Neighbourhood {
  int reach = 2;     ///< (2 reach + 1)² pixels,
  int spacing = 3;   ///< this many camera pixels apart
  double scale = 1;  ///< typical projector pixels per camera pixel
  int least = 6;     ///< with fewer neighbours there is no plane

  /// A larger step between pixels `distance` apart means another surface (three times the usual slope, and
  /// rounding).
  double largest_step(double distance) const { return 3 * scale * distance + 1.5; }
};

/// Plane through `position` around (row, col), over masked neighbours q with same(q) whose step belongs to
/// the surface. The centre's own value `centre` is the reference of the steps. The centre is used in the fit
/// only if it is masked.
template <class Same>
PositionPlane fit_plane(const Image<float>& position, const Image<std::uint8_t>& mask, int row, int col,
                        double centre, const Neighbourhood& hood, Same same);

/// Projector pixels per camera pixel: median over the map.
double typical_scale(const RawMap& map);

/// For each pixel, chooses between the decoded position of `axis` and its reflection inside its block of
/// `block` pixels; see DecodeOptions::held_out_pair. orientation: +1 or −1, the sign of det ∂(col,
/// row)/∂(camera col, camera row). Undecided pixels leave the mask.
void unfold(RawMap& map, StripeAxis axis, int block, double orientation);

/// Share of pixels where the map has this orientation, of those where the orientation is known.
double oriented_share(const RawMap& map, double orientation);

/// Removes pixels from the mask that too few of their neighbours support. The light of a glint or a crumpled
/// foil gives a position, but not one of the surface there. Positions do not change.
void drop_unsupported(RawMap& map, const DecodePolicy& policy);

/// Removes pixels from the mask that see the projector's border from beyond it. Blur lights them, so they get
/// a position on the border. Positions further inside predict where they look: a pixel stays if its own
/// position is at most `distance` [projector pixels] from there. Pixels away from the border stay.
void drop_beyond_border(RawMap& map, const GrayCode& code, double distance);

/// Replaces positions by the value of the local plane, drops pixels without neighbours that agree, and fills
/// small holes where `lit`.
void refine(RawMap& map, const Image<std::uint8_t>& lit);

/// Extends positions from the decoded pixels into the holes between them where `wanted`, by planes of growing
/// neighbourhoods (up to 48 camera pixels away).
void fill_holes(RawMap& map, const Image<std::uint8_t>& wanted);

}  // namespace symrig::calibration

namespace symrig::calibration {

/// Normal equations of a plane, summed point by point.
class PlaneSums {
 public:
  void add(double dcol, double drow, double value) {
    const Eigen::Vector3d x(1, dcol, drow);
    a_.noalias() += x * x.transpose();
    b_ += value * x;
    ++count_;
  }
  int count() const { return count_; }
  /// No plane (support 0) if the points lie on a line.
  PositionPlane solve() const {
    const Eigen::LDLT<Eigen::Matrix3d> factor(a_);
    if (factor.vectorD().minCoeff() < 1e-6 * factor.vectorD().maxCoeff()) return {};
    const Eigen::Vector3d x = factor.solve(b_);
    return {x[0], x[1], x[2], count_};
  }

 private:
  Eigen::Matrix3d a_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b_ = Eigen::Vector3d::Zero();
  int count_ = 0;
};

template <class Same>
PositionPlane fit_plane(const Image<float>& position, const Image<std::uint8_t>& mask, int row, int col,
                        double centre, const Neighbourhood& hood, Same same) {
  const Grid grid = mask.grid();
  PlaneSums sums;
  for (int i = -hood.reach; i <= hood.reach; ++i) {
    for (int j = -hood.reach; j <= hood.reach; ++j) {
      const int r = row + i * hood.spacing, c = col + j * hood.spacing;
      if (r < 0 || r >= grid.rows || c < 0 || c >= grid.cols || !mask.at(r, c) || !same(r, c)) continue;
      const double step = static_cast<double>(position.at(r, c)) - centre;
      if (std::abs(step) <= hood.largest_step(hood.spacing * std::hypot(i, j)))
        sums.add(j * hood.spacing, i * hood.spacing, step);
    }
  }
  if (sums.count() < hood.least) return {};
  PositionPlane plane = sums.solve();
  plane.value += centre;
  return plane;
}

/// Scales the stated standard deviations of one axis to the scatter of its positions.
/// How wrong a footprint's model is depends on the optics, so one constant (DecodePolicy::model_error) is too
/// large for one sequence and too small for another. Positions on a surface show it: their third difference
/// d = x₀ − 3 x₁ + 3 x₂ − x₃ is 0 for each position that bends like a parabola. If errors are independent,
/// its variance is V = σ₀² + 9 σ₁² + 9 σ₂² + σ₃². So 1.4826 median |d| / √V is the factor that is missing.
/// Errors repeat with the stripes. Pixels that see the same part of a stripe err alike, and pixels half a
/// period apart err oppositely: d is too small for the one, too large for the other. So the four pixels are 1
/// and 2 camera pixels apart, and the mean square of both factors counts. Stripes that follow the rows or
/// columns of the picture err alike along them, so the larger factor of both directions counts.
/// clarity: contrast over noise of a photograph. Noise and model dominate in other pixels, so four groups of
/// equal clarity have a factor each, and pixels between their middles one between theirs. Unchanged, if there
/// are fewer than 200 windows. error: a part of the error that is the same over a window stays unknown.
void scale_to_scatter(Image<float>& sigma, const RawMap& map, StripeAxis axis, const Image<float>& clarity);

inline constexpr int kSupportReach = 3;  ///< camera pixels; (2 · reach + 1)² pixels are used
inline constexpr int kSlopeApart = 3;    ///< camera pixels between the two positions of a slope

/// Neighbours of one pixel.
struct PixelSupport {
  float decoded = 0;   ///< how many have a position
  float agreeing = 0;  ///< how many of these predict the pixel's position
};

/// For each of `count` pixels of a row: how many pixels around it have a position, and how many of these
/// predict the pixel's own, with the median slopes of the window, within √farthest. The median of an even
/// number of slopes is the upper one. col, row: the positions of both axes at the first pixel, NaN where
/// there is none, in pictures whose rows are `stride` apart. kSupportReach pixels on all sides of the row
/// must be readable.
void count_support(const float* col, const float* row, std::ptrdiff_t stride, std::size_t count,
                   float farthest, PixelSupport* to);

}  // namespace symrig::calibration
