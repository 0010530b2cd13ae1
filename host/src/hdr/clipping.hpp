// SPDX-License-Identifier: Apache-2.0
// The code at which a camera clips, which may be below the largest one.
#pragma once

#include "hdr/sensor_statistics.hpp"
#include "symrig/hdr/merge.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace symrig::hdr {

/// The lower end of the values, if a share of them is within `within` of one value. nullopt also for fewer
/// than 50.
std::optional<double> piled_up(std::vector<double> values, double within, double share);

/// The code that 50 samples reach, or one in two thousand if these are more: stuck pixels may be brighter.
int brightest(Codes codes);

/// How the codes of a linear camera are read: codes − pedestal are proportional to light, with this noise in
/// the dark.
struct LinearCodes {
  double pedestal = 0;
  double read_noise = 0;  ///< [DN]
};

/// The code at which longer exposures stay, although the next shorter one expects more: by 2 % with a linear
/// camera, whose light has noise there, else by 30 %. codes: nullopt for a camera that may be curved.
/// nullopt: no exposure clips. error: up to five read noises low.
std::optional<int> clipping_of_bracket(std::span<const Frame> frames,
                                       const std::optional<LinearCodes>& codes);

/// The code at which a part of a flat frame stands: the window of its brightest codes has four times the
/// samples of any of four windows below. Light without clipping makes the windows below fuller.
std::optional<int> clipping_of_flat(Codes codes, double dark_noise);

}  // namespace symrig::hdr
