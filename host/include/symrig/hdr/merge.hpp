// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/radiance.hpp"

#include <cstdint>
#include <span>

namespace symrig {

/// One exposure of a bracket. raw: channels × grid.size() codes, planar, raster order.
/// exposure: how long the shutter was open, as measured from the pulse, never as printed on a dial.
struct Frame {
  std::span<const std::uint16_t> raw;
  Nanoseconds exposure{0};
};

/// The most frames one bracket may have.
inline constexpr int kMaxFrames = 8;

struct MergeOptions {
  double scale = 1;  ///< radiance per unit of projector light that one electron per second means
  const Radiance* black =
      nullptr;  ///< the photograph of the dark projector, in the units of the result; signed subtraction
  const Image<std::uint8_t>* dead =
      nullptr;  ///< camera pixels never to be trusted (1 = dead); grid × 1 or × channels
};

/// Merges the frames of one bracket into one photograph: mean = Σ w_k x_k / Σ w_k − black,
/// variance = 1 / Σ w_k + Var[black], with x_k = scale (raw_k − pedestal) / (gain t_k) and w_k = 1 / Var[x_k]
/// taken at an estimate that all frames share (merge.cpp says why). A saturated sample has weight exactly 0;
/// a pixel whose samples are all saturated, that is dead, or whose black is invalid is invalid (valid 0, mean
/// 0, variance 0). shapes: 1..kMaxFrames frames of channels × grid → grid × channels.  Order of the frames
/// does not matter to the model (only to rounding). error: variance is within 3 % of the truth from 0 e⁻ to
/// saturation; bias ≤ 0.02 σ, except within ±2 σ of the saturation of a frame, where dropping saturated
/// samples favours low ones: ≤ 0.4 σ of that frame's sample. Bit-equal for any number of threads and any
/// instruction set. fails: bad_argument (no frames or too many, exposure ≤ 0, scale not positive and finite,
/// noise model unusable, empty grid, a code beyond bits), size_mismatch, bad_value (NaN or infinity in
/// black).
Result<Radiance> merge(std::span<const Frame> frames, Grid grid, int channels, const NoiseModel& noise,
                       const MergeOptions& options = {});

/// Mean of photographs of the same thing (black brackets): mean = Σ x / n, variance = Σ Var[x] / n², over the
/// n valid ones of each value; valid where n ≥ 1. Their errors must be independent. fails: bad_argument (none
/// given), size_mismatch.
Result<Radiance> average(std::span<const Radiance> photographs);

}  // namespace symrig
