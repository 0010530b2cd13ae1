// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <memory>
#include <span>
#include <vector>

namespace symrig::sim {

/// A symmetric, non-negative linear operator on one channel of a grid: y = A x. The matrix is never stored.
/// Thread-safe for reading. x and y: grid size values in raster order that do not overlap. x may be negative.
class Transport {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;
  virtual void apply(std::span<const float> x, std::span<float> y) const = 0;
};

/// diag(d): light leaves at the pixel where it arrives.
class Diagonal final : public Transport {
 public:
  explicit Diagonal(std::vector<float> d) : d_(std::move(d)) {}
  void apply(std::span<const float> x, std::span<float> y) const override {
    for (std::size_t i = 0; i < d_.size(); ++i) y[i] = d_[i] * x[i];
  }

 private:
  std::vector<float> d_;
};

/// image ← B image: the separable 3-tap blur [a, 1 − 2a, a] along both axes. Light that leaves the picture is
/// lost, which keeps B symmetric.
void blur_3tap(Grid grid, float a, std::span<float> image);

/// A symmetric, non-negative, nearly Gaussian blur along one axis of n samples: W K Wᵀ / step. K is a
/// Gaussian of width sigma / step on every step-th sample, cut at 5 sigma. W is linear interpolation (step =
/// 1: W = I).
struct AxisBlur {
  AxisBlur(int n, double sigma);

  int n;
  int step;                   ///< samples between lattice points
  int nodes;                  ///< lattice points
  std::vector<float> kernel;  ///< kernel[|d|], d = 0..reach; sums to 1 over −reach..reach
  std::vector<int> node;      ///< left lattice neighbour of each sample
  std::vector<float> share;   ///< weight of the right neighbour

  int reach() const { return static_cast<int>(kernel.size()) - 1; }
};

/// Gaussians narrower than this [px] use every sample (step = 1).
inline constexpr double kFineWidth = 6;

/// G = (row blur) ⊗ (column blur), separable. Symmetric, non-negative, row sums ≤ 1 except at the ends of the
/// lattice.
class GaussianBlur {
 public:
  GaussianBlur(Grid grid, double sigma);
  /// out += weight · G in.
  void add(float weight, std::span<const float> in, std::span<float> out) const;

 private:
  Grid grid_;
  AxisBlur down_, across_;
};

}  // namespace symrig::sim
