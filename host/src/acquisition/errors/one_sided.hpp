// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

namespace symrig::acquisition {

/// Light that goes from a pixel to its neighbours on one side and not back. Its cause is a camera that is
/// shifted against the projector, or a one-sided flare. No symmetric tensor can hold it, and no tensor of an
/// aligned rig should.
struct OneSided {
  double energy = 0;  ///< Σ of the squares of such entries of T, at the least, beyond what chance does
  double sigmas = 0;  ///< significance
};

/// residual: (T − T̃) z on the grid, one channel, 0 where not valid; z: random signs of the lit pixels, 0
/// elsewhere. For entries
/// E, E[z' K' E z] = (lit share) Σ K E, which an antisymmetric K takes of one-sided light alone; K is ± 1
/// within boxes of 1, 2, 4 … pixels on either side of a pixel, along rows, columns and diagonals. With other
/// signs the sum would be 0 ± |K residual|. The strongest K is told.
OneSided one_sided(const Image<float>& residual, const Image<float>& z);

}  // namespace symrig::acquisition
