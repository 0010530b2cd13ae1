// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::sim::drawn {

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
