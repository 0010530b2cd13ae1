// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_optics/combs.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Dense>

namespace symrig::calibration {
namespace {

constexpr int kPeriod = CombPhotographs::period, kCombTile = 8;
/// More pixels cost time and add nothing.
constexpr double kMostCombPixels = 1e5;
constexpr std::size_t kFewestPixels = 500;
/// [cells] Near the border of the cells a comb ends.
constexpr double kMargin = 2;
/// Photographs are smoothed by a Gaussian of one pixel, because a picture's texture may change from pixel to
/// pixel, where it has no derivative. This makes both measured blurs larger by the same amount. The weights
/// reach this many pixels to each side.
constexpr int kSmoothReach = 6;
/// Derivatives of W that count.
constexpr int kOrders = 5;
constexpr int kCombRounds = 8;
/// What the model is off by everywhere alike, as a share of the light.
constexpr double kSame = 0.002;
/// What the model leaves, as a share of the flood-lit light, in the first round and at the least.
constexpr double kFirstMisfit = 0.02, kLeastMisfit = 1e-4;
/// [cells²] Of both blurs together.
constexpr double kLeastBoth = 1e-3, kMostBoth = 1;

/// A comb's profile with blur, and its derivatives [1 / cell^n].
using Profile = std::array<double, kOrders + 2>;

/// Lit from 0 to 1 in each four cells, blurred by this variance. x: [cells]
Profile comb_profile(double x, double variance) {
  const double width = std::sqrt(variance);
  const double from =
      x - kPeriod * std::floor((x + 1.5) / kPeriod);  // −1.5 to 2.5: the nearest lit cell is at 0
  Profile sum{};
  const auto border = [&](double at, double sign) {
    const double u = at / width;
    sum[0] += sign * 0.5 * std::erfc(-u / std::numbers::sqrt2);
    // Derivatives of a density are Hermite polynomials times it: φ⁽ⁿ⁾ = (−1)ⁿ He_n(u) φ / widthⁿ.
    double before = 0, hermite = 1;
    double factor = sign * std::exp(-0.5 * u * u) / (width * std::sqrt(2 * std::numbers::pi));
    for (std::size_t n = 1; n < sum.size(); ++n) {
      sum[n] += factor * hermite;
      before = std::exchange(hermite, u * hermite - static_cast<double>(n - 1) * before);
      factor /= -width;
    }
  };
  for (int lit = -1; lit <= 1; ++lit) border(from - kPeriod * lit, 1), border(from - kPeriod * lit - 1, -1);
  return sum;
}

/// What a pixel sees of the combs of one axis.
struct Sample {
  double at = 0;  ///< along the axis [cells]
  std::size_t tile = 0;
  double smoothed = 0;                      ///< variance of the smoothing along the axis [cells²]
  std::array<double, kOrders + 1> flood{};  ///< W and its derivatives along the axis [1 / cell^n]
  std::array<double, kPeriod> seen{}, variance{};
};

/// Weights of a Gaussian of one pixel and of its derivatives.
using SmoothWeights = std::array<std::array<double, 2 * kSmoothReach + 1>, kOrders + 1>;

const SmoothWeights& smooth_weights() {
  static const SmoothWeights all = [] {
    SmoothWeights weights{};
    for (int k = -kSmoothReach; k <= kSmoothReach; ++k) {
      const double x = k, density = std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
      // A correlation: the weight of the pixel at +x is the derivative at −x, so no sign is left.
      double before = 0, hermite = 1;
      const std::size_t at = k + kSmoothReach;
      for (std::size_t n = 0; n <= kOrders; ++n) {
        weights[n][at] = hermite * density;
        before = std::exchange(hermite, x * hermite - static_cast<double>(n) * before);
      }
    }
    return weights;
  }();
  return all;
}

/// The smoothed light around a pixel: derivatives[n][m] is the n-th along the rows' direction (down) and the
/// m-th to the right. None if a pixel is not valid.
using PixelDerivatives = std::array<std::array<double, kOrders + 1>, kOrders + 1>;

std::optional<PixelDerivatives> derivatives_of(const Radiance& photograph, int channel, int row, int col,
                                               int orders) {
  const SmoothWeights& weights = smooth_weights();
  PixelDerivatives found{};
  for (int r = -kSmoothReach; r <= kSmoothReach; ++r) {
    std::array<double, kOrders + 1> along{};
    for (int c = -kSmoothReach; c <= kSmoothReach; ++c) {
      if (!photograph.valid.at(row + r, col + c, channel)) return std::nullopt;
      const auto light = static_cast<double>(photograph.mean.at(row + r, col + c, channel));
      const std::size_t at = c + kSmoothReach;
      for (int m = 0; m <= orders; ++m) along[m] += weights[m][at] * light;
    }
    const std::size_t at = r + kSmoothReach;
    for (int n = 0; n <= orders; ++n)
      for (int m = 0; n + m <= orders; ++m) found[n][m] += weights[n][at] * along[m];
  }
  return found;
}

/// The n-th derivative along a step of `down` and `right` pixels: Σ C(n, m) downᵐ rightⁿ⁻ᵐ ∂ᵐ∂ⁿ⁻ᵐ.
double along_axis(const PixelDerivatives& derivatives, std::size_t n, double down, double right) {
  double sum = 0, choices = 1;
  for (std::size_t m = 0; m <= n; ++m) {
    sum += choices * std::pow(down, static_cast<double>(m)) * std::pow(right, static_cast<double>(n - m)) *
           derivatives[m][n - m];
    choices *= static_cast<double>(n - m) / static_cast<double>(m + 1);
  }
  return sum;
}

/// Gathers the pixels of one axis.
class Samples {
 public:
  Samples(const CombPixels& pixels, bool rows, std::size_t first_tile)
      : pixels_(pixels), rows_(rows), first_tile_(first_tile) {
    const Grid camera = pixels.flood.mean.grid();
    const double count = static_cast<double>(camera.size()) * pixels.flood.mean.channels();
    const int stride = std::max(1, static_cast<int>(std::sqrt(count / kMostCombPixels)));
    for (int channel = 0; channel < pixels.flood.mean.channels(); ++channel)
      for (int row = kSmoothReach; row + kSmoothReach < camera.rows; row += stride)
        for (int col = kSmoothReach; col + kSmoothReach < camera.cols; col += stride) add(row, col, channel);
  }
  std::vector<Sample> take() && { return std::move(samples_); }

 private:
  void add(int row, int col, int channel) {
    const CornerMap& map =
        pixels_.corners[pixels_.corners.size() == 1 ? 0 : static_cast<std::size_t>(channel)];
    const auto corner = [&](int r, int c, int axis) { return map.at(row + r, col + c, axis); };
    const auto step_down = [&](int axis) {
      return 0.5 * (corner(1, 0, axis) + corner(1, 1, axis) - corner(0, 0, axis) - corner(0, 1, axis));
    };
    const auto step_right = [&](int axis) {
      return 0.5 * (corner(0, 1, axis) + corner(1, 1, axis) - corner(0, 0, axis) - corner(1, 0, axis));
    };
    const int along = rows_ ? 0 : 1, across = 1 - along;
    const auto middle = [&](int axis) {
      return 0.25 * (corner(0, 0, axis) + corner(0, 1, axis) + corner(1, 0, axis) + corner(1, 1, axis));
    };
    const double x = middle(along), z = middle(across);
    const int length = rows_ ? pixels_.cells.rows : pixels_.cells.cols,
              width = rows_ ? pixels_.cells.cols : pixels_.cells.rows;
    if (!(x >= kMargin && x <= length - kMargin && z >= 1 && z <= width - 1)) return;
    const auto flood = derivatives_of(pixels_.flood, channel, row, col, kOrders);
    if (!flood || !((*flood)[0][0] > 0)) return;
    // How far the picture's pixels move for a step of one cell along the axis.
    const double determinant = step_down(along) * step_right(across) - step_right(along) * step_down(across);
    const double down = step_right(across) / determinant, right = -step_down(across) / determinant;
    Sample sample{.at = x,
                  .tile = first_tile_ + tile_of(x, z, width),
                  .smoothed = step_down(along) * step_down(along) + step_right(along) * step_right(along)};
    for (std::size_t n = 0; n <= kOrders; ++n) sample.flood[n] = along_axis(*flood, n, down, right);
    for (int k = 0; k < kPeriod; ++k) {
      const Radiance& comb =
          (rows_ ? pixels_.combs.rows : pixels_.combs.columns)[static_cast<std::size_t>(k)];
      const auto seen = derivatives_of(comb, channel, row, col, 0);
      if (!seen) return;
      sample.seen[k] = (*seen)[0][0];
      // Σ weight² = 1 / (4 π) of a Gaussian of one pixel.
      sample.variance[k] = static_cast<double>(comb.variance.at(row, col, channel)) / (4 * std::numbers::pi);
    }
    samples_.push_back(sample);
  }
  static std::size_t tile_of(double x, double z, int width) {
    const int across = (width + kCombTile - 1) / kCombTile;
    return static_cast<std::size_t>(x / kCombTile) * static_cast<std::size_t>(across) +
           static_cast<std::size_t>(z / kCombTile);
  }

  const CombPixels& pixels_;
  bool rows_;
  std::size_t first_tile_;
  std::vector<Sample> samples_;
};

using Vector4 = Eigen::Vector4d;
using Matrix4 = Eigen::Matrix4d;

// The model of a pixel at x under comb k, with the flood-lit light W and its derivatives along the axis,
// the comb's profile S blurred by b, and the camera's variance q (fit_comb_blur):
//
//   y = W / 4 + α (Σ_n qⁿ / n! W⁽ⁿ⁾ S⁽ⁿ⁾ − W / 4) + β Σ_n qⁿ / n! W⁽ⁿ⁾ S⁽ⁿ⁺¹⁾
//
// α, β: factor and shift of the pixel's tile. So the fit has two unknowns a tile, and b and q for all. One
// round:
// 1. row_of: the derivatives of y by α, β, b, q, and what the model leaves.
// 2. step: each tile's 4 × 4 normal equations, with Tukey's weights of what is left over noise and misfit.
// 3. solve: α and β are eliminated tile by tile (Schur complement), which leaves a 2 × 2 system for b and
//    q. The covariance is N⁻¹ C N⁻¹ with the scatter C of what the tiles want, since pixels of a tile err
//    together.

/// Gauss and Newton over the tiles' own unknowns, which are eliminated, and both blurs.
class CombBlurFit {
 public:
  CombBlurFit(std::vector<Sample> samples, std::size_t tiles, double both, double camera, double camera_sigma)
      : samples_(std::move(samples)),
        tiles_(tiles, Eigen::Vector2d(1, 0)),
        blur_(std::clamp(both, kLeastBoth, kMostBoth), camera),
        prior_(camera),
        prior_variance_(camera_sigma * camera_sigma) {}

  void fit() {
    for (int round = 0; round < kCombRounds; ++round) step();
  }
  double both() const { return blur_[0]; }
  double camera() const { return blur_[1]; }
  /// Standard deviation of `camera`.
  double camera_sigma() const { return std::sqrt(std::max(0.0, covariance_(1, 1))); }

 private:
  /// Sums of a tile: of its factor and shift, and of both blurs.
  struct Sums {
    Matrix4 normal = Matrix4::Zero();
    Vector4 right = Vector4::Zero();
  };

  /// Of one comb: the columns of the fit, and what the model leaves.
  struct Row {
    Vector4 columns;
    double left;
  };
  Row row_of(const Sample& s, int comb) const {
    const double q = blur_[1] + s.smoothed;
    const Profile p = comb_profile(s.at - comb, blur_[0] + s.smoothed);
    const double even = 1.0 / kPeriod;  // light of the scene comes from all combs alike
    double base = s.flood[0] * (p[0] - even), shift = s.flood[0] * p[1], wider = 0.5 * s.flood[0] * p[2],
           camera = 0;
    double factor = 1;  // qⁿ / n!
    for (std::size_t n = 1; n <= kOrders; ++n) {
      camera += factor * s.flood[n] * p[n];
      factor *= q / static_cast<double>(n);
      base += factor * s.flood[n] * p[n];
      shift += factor * s.flood[n] * p[n + 1];
    }
    wider += 0.5 * q * s.flood[1] * p[3];
    const Eigen::Vector2d& own = tiles_[s.tile];
    return {{base, shift, own[0] * wider, own[0] * camera},
            s.seen[static_cast<std::size_t>(comb)] - even * s.flood[0] - own[0] * base - own[1] * shift};
  }

  void step() {
    std::vector<Sums> sums(tiles_.size());
    light_ = 0;
    std::vector<double> shares;
    shares.reserve(samples_.size());
    for (const Sample& s : samples_)
      for (int k = 0; k < kPeriod; ++k) {
        const Row row = row_of(s, k);
        const double variance =
            s.variance[static_cast<std::size_t>(k)] + misfit_ * misfit_ * s.flood[0] * s.flood[0];
        const double weight = tukey_weight(row.left / std::sqrt(variance)) / variance;
        if (k == 0) shares.push_back(row.left / s.flood[0]);
        if (weight == 0) continue;
        light_ += weight * row.columns[0] * row.columns[0];
        sums[s.tile].normal += weight * row.columns * row.columns.transpose();
        sums[s.tile].right += weight * row.left * row.columns;
      }
    misfit_ = std::max(kLeastMisfit, robust_sigma(shares, 0));
    solve(sums);
  }

  void solve(const std::vector<Sums>& sums) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero(), scatter = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    std::vector<Eigen::Matrix2d> inverse(sums.size(), Eigen::Matrix2d::Zero());
    for (std::size_t t = 0; t < sums.size(); ++t) {
      const Eigen::Matrix2d own = sums[t].normal.topLeftCorner<2, 2>();
      if (!(own.determinant() > 0)) continue;
      inverse[t] = own.inverse();
      const Eigen::Matrix2d cross = sums[t].normal.bottomLeftCorner<2, 2>();
      const Eigen::Vector2d wants = sums[t].right.tail<2>() - cross * inverse[t] * sums[t].right.head<2>();
      normal += sums[t].normal.bottomRightCorner<2, 2>() - cross * inverse[t] * cross.transpose();
      right += wants;
      scatter += wants * wants.transpose();
    }
    if (prior_variance_ > 0 && normal(1, 1) > 0) {
      // What the model leaves is no noise: pixels of a tile err together. Tiles scatter more than the pixels'
      // weights say, and a prior that counts as much less would be worth nothing.
      const double overstated = std::max(scatter(1, 1) / normal(1, 1), 1 + kSame * kSame * light_);
      normal(1, 1) += overstated / prior_variance_;
      right[1] += overstated * (prior_ - blur_[1]) / prior_variance_;
      scatter(1, 1) += overstated * overstated / prior_variance_;
    }
    const Eigen::Matrix2d solved = normal.inverse();
    if (!solved.allFinite()) return;
    const Eigen::Vector2d change = solved * right;
    covariance_ = solved * scatter * solved;
    for (std::size_t t = 0; t < sums.size(); ++t)
      tiles_[t] += inverse[t] * (sums[t].right.head<2>() - sums[t].normal.topRightCorner<2, 2>() * change);
    blur_[0] =
        std::clamp(std::clamp(blur_[0] + change[0], 0.5 * blur_[0], 2 * blur_[0]), kLeastBoth, kMostBoth);
    blur_[1] = std::min(std::clamp(blur_[1] + change[1], 0.5 * blur_[1], 2 * blur_[1]), blur_[0]);
  }

  std::vector<Sample> samples_;
  std::vector<Eigen::Vector2d> tiles_;  ///< factor; shift times factor [cells]
  Eigen::Vector2d blur_;                ///< variances: both, camera [cells²]
  double prior_, prior_variance_, misfit_ = kFirstMisfit;
  double light_ = 0;  ///< Σ weight light²
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Zero();
};

}  // namespace

OpticsBlur fit_comb_blur(const CombPixels& pixels, const OpticsBlur& first) {
  const auto tiles = [&](int length, int width) {
    return static_cast<std::size_t>((length + kCombTile - 1) / kCombTile) *
           static_cast<std::size_t>((width + kCombTile - 1) / kCombTile);
  };
  const std::size_t of_rows = tiles(pixels.cells.rows, pixels.cells.cols),
                    of_columns = tiles(pixels.cells.cols, pixels.cells.rows);
  std::vector<Sample> samples = Samples(pixels, true, 0).take(),
                      columns = Samples(pixels, false, of_rows).take();
  samples.insert(samples.end(), columns.begin(), columns.end());
  if (samples.size() < kFewestPixels || !(first.camera > 0)) return first;
  const double both = first.projector * first.projector + first.camera * first.camera;
  // From σp − σc to σc², with σp² + σc² known: dσc² = 2 σc σp / (σp + σc) · d(σp − σc).
  const double slope = 2 * first.camera * first.projector / (first.projector + first.camera);
  CombBlurFit fit(std::move(samples), of_rows + of_columns, both, first.camera * first.camera,
                  slope * first.sigma);
  fit.fit();
  // A scene without texture tells nothing of q.
  if (!(fit.camera_sigma() < slope * first.sigma)) return first;
  OpticsBlur found = first;
  found.camera = std::sqrt(fit.camera());
  found.projector = std::sqrt(std::max(0.0, fit.both() - fit.camera()));
  const double back = 2 * found.camera * found.projector / (found.projector + found.camera);
  if (back > 0) found.sigma = fit.camera_sigma() / back;
  return found;
}

}  // namespace symrig::calibration
