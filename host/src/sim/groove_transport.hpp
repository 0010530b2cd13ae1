// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/exchange.hpp"
#include "sim/transport.hpp"

#include <memory>
#include <vector>

namespace symrig::sim {

/// Light that leaves a groove after one to four reflections:
///   T = cos 45° (R + indirect · Σ_{k=1..3} (R F)^k R),  R = diag(albedo),  F the exchange.
/// Symmetric because R and F are symmetric. units: radiosity towards the rig per unit of projector light on a
/// plane that faces it. With albedo ≤ 0.8 and indirect ≤ 1, every row sums to at most 0.71 · (0.8 + 0.8 x +
/// 0.8 x² + 0.8 x³) ≤ 0.95, x = 0.8 · 0.5. The factor 0.5: the other plane fills at most half of the sky of a
/// point.
/// source: the radiosity series; [Garg06 §4.1] explains why its blocks are low-rank.
class GrooveTransport final : public Transport {
 public:
  GrooveTransport(std::shared_ptr<const Exchange> exchange, std::vector<float> albedo, double indirect);
  void apply(std::span<const float> x, std::span<float> y) const override;

  static constexpr int kBounces = 3;  ///< between the planes, after the direct reflection

 private:
  std::shared_ptr<const Exchange> exchange_;
  std::vector<float> albedo_;
  float indirect_;
};

}  // namespace symrig::sim
