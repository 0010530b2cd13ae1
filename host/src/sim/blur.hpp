// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/transport.hpp"
#include "symrig/image/grid.hpp"

#include <memory>
#include <span>

namespace symrig::sim {

/// image ← B image: the separable 3-tap blur [a, 1 − 2a, a] along both axes. Light that leaves the picture is
/// lost, which keeps B symmetric.
void blur_3tap(Grid grid, float a, std::span<float> image);

/// B T Bᵀ: projector and camera have equal lens blur.
std::unique_ptr<Transport> blurred(Grid grid, double a, std::unique_ptr<Transport> transport);

}  // namespace symrig::sim
