// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/radiance.hpp"

namespace symrig::calibration {

/// A photograph whose means are blurred by a Gaussian of this rms width [pixels]. Invalid pixels, and those
/// beyond the border, are left out. A pixel that was invalid stays so. Neighbouring pixels then share noise,
/// so a sum over many keeps its variance: the variances stay as they are.
Radiance blurred(const Radiance& photograph, double width);

}  // namespace symrig::calibration
