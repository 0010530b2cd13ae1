// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"

#include <span>
#include <vector>

namespace symrig::sim {

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
