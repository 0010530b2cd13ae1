// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/drawn/survey.hpp"
#include "sim/light/transport.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::sim::drawn {

/// Non-negative pictures u_k with mean 1, each point by itself. Σ_k u_k(i) u_k(j) / count is 1 on average,
/// and different for each pair of points: speckle of rank `count`.
std::vector<std::vector<float>> speckle_pictures(std::uint64_t key, std::size_t points, int count);
inline constexpr int kSpeckles = 6;

/// Light inside one body:
///   T = diag(a) (near G_n + far Σ_k diag(u_k) G_f diag(u_k) / kSpeckles) diag(a)
/// a: the entrance of each point, 0 outside the body. Without speckle: u = 1. G: separable Gaussians in the
/// picture.
/// source: the diffusion kernel of [Jensen01] as a sum of Gaussians, as in scenes.cpp.
class Translucent {
 public:
  /// entrance: on the grid, raster order.
  Translucent(const Translucency& inside, Grid grid, std::span<const float> entrance);
  /// y += weight · T x.
  void add(float weight, std::span<const float> x, std::span<float> y) const;

 private:
  Translucent(const Translucency& inside, Grid grid, std::span<const float> entrance, const Tile& bounds);
  std::size_t point(std::size_t i) const {
    const std::size_t cols = part_.cols;
    return first_ + i / cols * stride_ + i % cols;
  }

  std::size_t stride_, first_;  // the part of the picture that holds the body
  Grid part_;
  std::vector<float> entrance_;
  float near_, far_;
  GaussianBlur narrow_, wide_;
  std::vector<std::vector<float>> speckles_;
};

/// Speckled light from every surface to every other, however far:
///   T = share / (kSpeckles · points) Σ_k diag(ρ) u_k u_kᵀ diag(ρ),  u_k: speckle_pictures()
/// On average a point with albedo ρ returns share · ρ · the mean albedo.
class Haze {
 public:
  Haze(double share, std::uint64_t key, std::span<const float> albedo);
  /// y += weight · T x.
  void add(float weight, std::span<const float> x, std::span<float> y) const;

 private:
  float share_;
  std::vector<std::vector<float>> pictures_;  // ρ u_k
};

}  // namespace symrig::sim::drawn
