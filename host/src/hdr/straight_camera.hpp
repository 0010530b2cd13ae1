// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hdr/response_samples.hpp"
#include "symrig/hdr/noise_model.hpp"

#include <optional>
#include <span>

namespace symrig::hdr {

/// A camera whose codes are pedestal + rate · exposure, with the noise of its codes, if a bracket alone shows
/// that it is one. Most cameras of 10 bits and more are, and a straight line has no unknowns at dark codes.
/// nullopt: the codes depart from a straight line by 1 % of their light, noise aside; or they show too
/// little. error: pedestal and noise as far as the bracket shows them, gain to some 10 %.
std::optional<NoiseModel> straight_camera(std::span<const Frame> frames, const UsableCodes& codes);

}  // namespace symrig::hdr
