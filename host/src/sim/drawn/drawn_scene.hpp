// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/drawn/interreflection.hpp"
#include "sim/light/transport.hpp"
#include "symrig/sim/scene.hpp"

#include <memory>
#include <vector>

namespace symrig::sim::drawn {

/// Light of a drawn scene, one channel:
///
///   T = s M (D + indirect · (P + Σ_b t_b + h)) Mᵀ
///   D = diag(ρ_surface cos θ (1 + gloss lobe)),  P = ρ K₁ ρ + ρ K (ρ/cos θ) K ρ + ρ K (ρ/cos θ) K (ρ/cos θ)
///   K ρ
///
/// ρ: albedo; K: Interreflection, K₁ with its glossy lobes; t_b: Translucent; h: Haze; M: reflections().
/// Every term is a sum of A B Aᵀ with symmetric B ≥ 0. units: radiosity towards the rig per unit of
/// projector light on a plane that faces it.
/// The factor s ≤ 1 makes sure that no row of T sums to more than kMostLight at indirect = 1. T is symmetric,
/// so also no point returns more light than it gets.
std::vector<std::unique_ptr<Transport>> drawn_scene(const SceneUri& uri);

inline constexpr double kMostLight = 0.999;

}  // namespace symrig::sim::drawn
