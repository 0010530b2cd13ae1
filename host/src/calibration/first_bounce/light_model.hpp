// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/fitting/least_squares.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

namespace symrig::calibration {

/// Weights of a camera pixel's footprint along one axis of the projector: pixels [first, first + count), Σ
/// weight = 1.
struct Taps {
  static constexpr int kMax = 32;
  int first = 0, count = 0;
  std::array<float, kMax> weight{};

  /// Σ weight · values over the axis.
  float sum(std::span<const float> values) const {
    const auto under = values.subspan(first, count);
    float total = 0;
    for (std::size_t i = 0; i < under.size(); ++i) total += weight[i] * under[i];
    return total;
  }
};

/// The widest blur that Taps can hold at three sigmas.
inline constexpr double kLargestSigma = 4;

/// A Gaussian of `sigma` around `position`, integrated over each pixel j, which covers [j − ½, j + ½). It is
/// cut at three sigmas and at the border of the `size` pixels, then scaled to the sum 1.
inline Taps gaussian_taps(double position, double sigma, int size) {
  const double reach = 3 * sigma + 0.5;
  Taps taps;
  taps.first = std::clamp(static_cast<int>(std::ceil(position - reach)), 0, size - 1);
  const int last = std::clamp(static_cast<int>(std::floor(position + reach)), taps.first,
                              std::min(size, taps.first + Taps::kMax) - 1);
  taps.count = last - taps.first + 1;
  const auto below = [&](double x) { return 0.5 * std::erf((x - position) / (sigma * std::numbers::sqrt2)); };
  double sum = 0, left = below(taps.first - 0.5);
  std::array<double, Taps::kMax> weight{};
  for (int i = 0; i < taps.count; ++i) {
    const double right = below(taps.first + i + 0.5);
    sum += weight[i] = right - left;
    left = right;
  }
  for (int i = 0; i < taps.count; ++i)
    taps.weight[i] = sum > 0 ? static_cast<float>(weight[i] / sum) : 1.0F / static_cast<float>(taps.count);
  return taps;
}

/// The projector divided into the blocks of one level of its tree: rows × columns of them.
class Surroundings {
 public:
  /// Uses the level whose block width is nearest to `size` pixels.
  Surroundings(const BlockTree& tree, int size);

  int rows() const { return static_cast<int>(row_starts_.size()) - 1; }
  int cols() const { return static_cast<int>(col_starts_.size()) - 1; }
  std::size_t index(int row, int col) const {
    return static_cast<std::size_t>(row) * (col_starts_.size() - 1) + static_cast<std::size_t>(col);
  }
  /// Tree range of block (row, col).
  const Block& block(int row, int col) const { return *blocks_[index(row, col)]; }

  /// Means of a pattern that changes along one axis, one for each block of that axis.
  std::vector<float> column_means(std::span<const float> values) const { return means(values, col_starts_); }
  std::vector<float> row_means(std::span<const float> values) const { return means(values, row_starts_); }

  /// The weights of blocks in the surroundings of a position: linear between the two nearest centres.
  Taps column_taps(double position) const { return linear_taps(position, col_centres_); }
  Taps row_taps(double position) const { return linear_taps(position, row_centres_); }

 private:
  static std::vector<float> means(std::span<const float> values, const std::vector<int>& starts);
  static Taps linear_taps(double position, const std::vector<double>& centres);

  std::vector<int> row_starts_, col_starts_;  // first pixel of each block along the axis, and the end
  std::vector<double> row_centres_, col_centres_;
  std::vector<const Block*> blocks_;
};

/// The number of sizes of surroundings that near light may come from.
inline constexpr std::size_t kNearSizes = 3;

/// The light model of one camera pixel: y(p) = black + direct · d(p) + Σ_z near_z · n_z(p) + far · f(p), with
/// direct, near, far ≥ 0.
struct PixelLight {
  double black = 0, direct = 0;
  std::array<double, kNearSizes> near{};
  double far = 0;
  double squared_residual = 0;  ///< sum over the photographs
};

/// Light of one pattern on one camera pixel, 0..1 each.
struct PatternLight {
  double direct = 0;                      ///< on its footprint
  std::array<double, kNearSizes> near{};  ///< on the surroundings of the footprint, by size
  double far = 0;                         ///< mean over the projector
};

/// Linear least squares of PixelLight, summed photograph by photograph.
class PixelLightFit {
 public:
  /// y: the value of the camera pixel.
  void add(const PatternLight& p, double y) {
    const Solver::Vector x{1, p.direct, p.near[0], p.near[1], p.near[2], p.far};
    for (std::size_t i = 0; i < kUnknowns; ++i) {
      for (std::size_t j = 0; j < kUnknowns; ++j) a_[i][j] += x[i] * x[j];
      b_[i] += y * x[i];
    }
    yy_ += y * y;
  }

  /// Least squares with direct, near, far ≥ 0. Direct light below `least` of its standard errors at unit
  /// noise is set to 0. So is near light of a size that lowers the squared residual by less than
  /// `least_near`². If `lit` is false, direct and near light are 0.
  PixelLight solve(bool lit, double least, double least_near) const;

 private:
  static constexpr std::size_t kUnknowns = 3 + kNearSizes;
  using Solver = NonNegative<kUnknowns>;
  using Point = Solver::Point;

  double ridge() const;
  double squared_residual(const Solver::Vector& x) const;
  Point without_noise(const Solver& solver, double least, Solver::Set& allowed) const;
  PixelLight light_of(const Point& point) const;

  Solver::Matrix a_{};
  Solver::Vector b_{};
  double yy_ = 0;
};

/// The footprint of one camera pixel on the projector: separable, Σ = 1.
struct Footprint {
  Taps col, row;
};

Footprint footprint(const PixelMap& map, std::size_t pixel, double sigma);

/// A blur, and its squared residual in a sample of the pixels.
struct FittedBlur {
  double sigma = 0;
  double squared_residual = 0;
};

/// The photographs that a fit may use, and the light of their patterns on a pixel's footprint and
/// surroundings.
class LightModel {
 public:
  /// Leaves out DecodeOptions::held_out_pair. All arguments must outlive the model.
  LightModel(const CodePhotographs& photographs, const DecodeOptions& options,
             std::span<const Surroundings> surroundings);

  std::size_t photographs() const { return seen_.size(); }

  /// Light of one camera pixel, at this blur [projector pixels].
  PixelLight fit(const PixelMap& map, std::size_t pixel, double sigma) const;
  std::vector<PixelLight> fit_all(const PixelMap& map, double sigma) const;
  /// The blur with the least residual over a sample of the decoded pixels.
  FittedBlur best_blur(const PixelMap& map) const;

 private:
  /// One photograph. Its pattern changes along one axis (white and black along none).
  struct Observation {
    const float* pixels = nullptr;
    StripeAxis axis = StripeAxis::columns;
    std::vector<float> stripes;                         ///< the pattern along its axis
    std::array<std::vector<float>, kNearSizes> blocks;  ///< its means over the blocks of each surroundings
    double mean = 0;                                    ///< its mean over the projector
  };

  Observation observe(const CodePhotographs& photographs, int index) const;
  double squared_residual(const PixelMap& map, double sigma) const;

  std::span<const Surroundings> surroundings_;  ///< kNearSizes of them
  double model_error_;                          ///< DecodePolicy::model_error
  std::vector<Observation> seen_;
};

}  // namespace symrig::calibration
