// SPDX-License-Identifier: Apache-2.0
#include "calibration/photograph_each.hpp"
#include "symrig/calibration/camera_optics.hpp"
#include "symrig/image/grid.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

namespace symrig {
namespace {

constexpr int kSide = 4, kBlocks = kSide * kSide, kShapes = kGainShapes;
/// Unknowns: the shapes, and the veil.
constexpr int kUnknowns = kShapes + 1;
/// A pair counts if both of its sums are this many standard deviations above nothing.
constexpr double kBright = 10;
/// A priori standard deviations: of log g at the corner by each shape, and of the veil.
constexpr double kPriorShape = 0.5, kPriorVeil = 0.02;
/// What the shapes do not follow: relative error of a sum over a block.
constexpr double kMisfit = 3e-4;
/// A ratio with a larger standard deviation would do more harm than good.
constexpr double kLargestSigma = 0.02;
constexpr int kRounds = 5;

using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Shapes = Eigen::Matrix<double, kShapes, 1>;

std::vector<Shapes> shapes_of(Grid cells) {
  std::vector<Shapes> shapes;
  shapes.reserve(static_cast<std::size_t>(cells.size()));
  for (const GainShapes& one : gain_shapes(cells)) shapes.emplace_back(one.data());
  return shapes;
}

int block_of(Grid cells, std::size_t cell) {
  const auto row = static_cast<std::int64_t>(cell) / cells.cols,
             col = static_cast<std::int64_t>(cell) % cells.cols;
  return static_cast<int>(row * kSide / cells.rows * kSide + col * kSide / cells.cols);
}

bool touch(int a, int b) {
  return std::abs(a / kSide - b / kSide) <= 1 && std::abs(a % kSide - b % kSide) <= 1;
}

/// The light of one lit block in each block.
struct Received {
  double light = 0, variance = 0;
  double even = 0;                ///< Σ light / g
  Shapes shape = Shapes::Zero();  ///< Σ light / g · shapes
  Shapes mean() const { return shape / even; }
  double log_gain() const { return std::log(light / even); }
};

/// Solves for the shapes and the veil.
class GainFit {
 public:
  GainFit(Grid cells, std::vector<Radiance> photographs)
      : cells_(cells), photographs_(std::move(photographs)), shapes_(shapes_of(cells)) {}

  GainRatio fit();

 private:
  void sum_up();
  /// One step of Gauss and Newton. Returns the squares of the residuals by their variances.
  double step(Eigen::Matrix<double, kUnknowns, kUnknowns>& covariance);
  /// The light of all blocks together.
  double all(int lit) const {
    double sum = 0;
    for (int in = 0; in < kBlocks; ++in) sum += seen(in, lit).light;
    return sum;
  }
  const Received& seen(int in, int lit) const { return received_[lit * kBlocks + in]; }

  Grid cells_;
  std::vector<Radiance> photographs_;
  std::vector<Shapes> shapes_;
  std::vector<Received> received_;
  Unknowns found_ = Unknowns::Zero();
  std::int64_t pairs_ = 0;
};

void GainFit::sum_up() {
  received_.assign(std::size_t{kBlocks} * kBlocks, {});
  for (int lit = 0; lit < kBlocks; ++lit) {
    const Radiance& photograph = photographs_[lit];
    for (int c = 0; c < photograph.mean.channels(); ++c)
      for (std::size_t i = 0; i < shapes_.size(); ++i) {
        if (!photograph.valid.plane(c)[i]) continue;
        Received& to = received_[lit * kBlocks + block_of(cells_, i)];
        const auto light = static_cast<double>(photograph.mean.plane(c)[i]);
        const double even = light * std::exp(-shapes_[i].dot(found_.head<kShapes>()));
        to.light += light;
        to.variance += static_cast<double>(photograph.variance.plane(c)[i]);
        to.even += even;
        to.shape += even * shapes_[i];
      }
  }
}

double GainFit::step(Eigen::Matrix<double, kUnknowns, kUnknowns>& covariance) {
  const double veil = found_[kShapes];
  Eigen::Matrix<double, kUnknowns, kUnknowns> normal = Eigen::Matrix<double, kUnknowns, kUnknowns>::Zero();
  for (int k = 0; k < kShapes; ++k) normal(k, k) = 1 / (kPriorShape * kPriorShape);
  normal(kShapes, kShapes) = 1 / (kPriorVeil * kPriorVeil);
  Unknowns right = -normal * found_;
  double squares = 0;
  pairs_ = 0;
  for (int a = 0; a < kBlocks; ++a)
    for (int b = a + 1; b < kBlocks; ++b) {
      if (touch(a, b)) continue;
      const Received &there = seen(a, b), &back = seen(b, a);
      // The veil puts a share of all light of the photograph into each block.
      const double x = there.light - veil * all(b), y = back.light - veil * all(a);
      const bool bright = x > kBright * std::sqrt(there.variance) && y > kBright * std::sqrt(back.variance) &&
                          there.even > 0 && back.even > 0 && x > 0.2 * there.light && y > 0.2 * back.light;
      if (!bright) continue;
      const double residual = std::log(x / y) - (there.log_gain() - back.log_gain());
      const double variance = there.variance / (x * x) + back.variance / (y * y) + 2 * kMisfit * kMisfit;
      Unknowns slope;
      slope.head<kShapes>() = there.mean() - back.mean();
      slope[kShapes] = all(b) / x - all(a) / y;
      normal += slope * slope.transpose() / variance;
      right += slope * residual / variance;
      squares += residual * residual / variance;
      ++pairs_;
    }
  covariance = normal.inverse();
  found_ += covariance * right;
  return squares;
}

GainRatio GainFit::fit() {
  Eigen::Matrix<double, kUnknowns, kUnknowns> covariance;
  double squares = 0;
  for (int round = 0; round < kRounds; ++round) {
    sum_up();
    squares = step(covariance);
  }
  const double free = std::max<double>(1, static_cast<double>(pairs_) - kUnknowns);
  covariance *= std::max(1.0, squares / free);
  GainRatio gain;
  gain.pairs = pairs_;
  double variance = 0;
  for (const Shapes& one : shapes_) variance += one.dot(covariance.topLeftCorner<kShapes, kShapes>() * one);
  gain.sigma = std::sqrt(variance / static_cast<double>(shapes_.size()));
  gain.veil = found_[kShapes];
  gain.veil_sigma = std::sqrt(covariance(kShapes, kShapes));
  // Without any pair there is nothing to divide by.
  if (!std::isfinite(gain.veil)) gain.veil = 0;
  gain.known = pairs_ >= kUnknowns && gain.sigma <= kLargestSigma;
  if (gain.known) std::copy_n(found_.data(), kShapes, gain.shape.begin());
  return gain;
}

}  // namespace

Image<float> GainRatio::over(Grid cells) const {
  const std::vector<Shapes> shapes = shapes_of(cells);
  const Shapes weights(shape.data());
  Image<float> gain(cells);
  for (std::size_t i = 0; i < shapes.size(); ++i)
    gain.values()[i] = static_cast<float>(std::exp(shapes[i].dot(weights)));
  return gain;
}

double GainRatio::spread(Grid cells) const {
  const Image<float> gain = over(cells);
  const auto [least, most] = std::ranges::minmax(gain.values());
  return static_cast<double>(most / least);
}

Result<GainRatio> measure_gain_ratio(Probe& probe, const Image<std::uint8_t>& seen,
                                     const Progress& progress) {
  const Grid cells = probe.grid();
  if (seen.grid() != cells || probe.camera_grid() != cells)
    return Error{ErrorCode::size_mismatch, "the gain ratio is measured on the projector's cells",
                 "wrap the rig in a RegisteredProbe"};
  if (std::min(cells.rows, cells.cols) < 2 * kSide) return GainRatio{};
  std::vector<Pattern> blocks(kBlocks, Pattern(cells, 1));
  for (std::size_t i = 0; i < seen.values().size(); ++i)
    if (seen.values()[i]) blocks[block_of(cells, i)].values()[i] = 1;
  SYMRIG_TRY(auto photographs, calibration::photograph_each(probe, blocks, "gain ratio", progress));
  return GainFit(cells, std::move(photographs)).fit();
}

}  // namespace symrig
