// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"

#include <cstdint>
#include <span>

namespace symrig::calibration {

/// Solves pixels = A cells, where pixel (i, j) shows the square of cells at (i, j) + shift by area, and what
/// lies beyond the grid is dark. A is near 1, so cells ← cells + (pixels − A cells) converges: its error
/// falls by 1 − (1 − 2 |shift|)² in each of 24 rounds, to 2e-5 for a shift of 0.2 along both axes. A pixel
/// that is not valid counts as the mean of its neighbours in the equations of others. cells: one for each
/// pixel.
void unmix(Grid grid, Point shift, std::span<const float> pixels, std::span<const std::uint8_t> valid,
           std::span<float> cells);

/// The variance of a cell, divided by that of a pixel.
double unmixed_noise(Point shift);

/// A photograph whose means are blurred by a Gaussian of this rms width [pixels]. Invalid pixels, and those
/// beyond the border, are left out. A pixel that was invalid stays so. Neighbouring pixels then share noise,
/// so a sum over many keeps its variance: the variances stay as they are.
Radiance blurred(const Radiance& photograph, double width);

}  // namespace symrig::calibration
