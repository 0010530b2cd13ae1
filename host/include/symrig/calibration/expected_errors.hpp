// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/registration.hpp"
#include "symrig/image/view_layout.hpp"

#include <optional>

namespace symrig {

/// The relative error of `indirect` that a capture with a registration will have, apart from its tolerance.
struct ExpectedIndirect {
  double surfaces = 0;    ///< of opaque, matt scenes: within a factor of 2
  double scattering = 0;  ///< of translucent scenes and mirrors: at most about this
};

/// What pixels on the borders of cells cannot tell, by the number p of camera pixels along the side of a
/// cell: 0.22 / p on surfaces, where the error is that of cells next to lit ones; 1.1 / p² where light
/// spreads inside a cell. nullopt: the pixels do not keep clear of borders (Weighting::cores), so the cells
/// of a coaxial rig with the same blur err as much; or there are several views, which err more. source:
/// measured on simulated benches of 2.25 to 6 pixels (docs/research/registration.md, Camera pixels along
/// the side of a cell).
std::optional<ExpectedIndirect> expected_indirect(const Registration& registration, ViewLayout views);

}  // namespace symrig
