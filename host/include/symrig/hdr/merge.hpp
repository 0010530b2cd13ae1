// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/radiance.hpp"

#include <cstdint>
#include <span>

namespace symrig {

/// One exposure of a bracket. raw: channels × grid.size() codes, planar, raster order.
/// exposure: how long the shutter was open, measured from the pulse, not a nominal value.
struct Frame {
  std::span<const std::uint16_t> raw;
  Nanoseconds exposure{0};
};

/// The most frames one bracket may have.
inline constexpr int kMaxFrames = 8;

struct MergeOptions {
  double scale = 1;  ///< radiance (per unit of projector light) of one electron per second
  /// The photograph of the dark projector, in the units of the result; its subtraction is signed.
  const Radiance* black = nullptr;
  /// Camera pixels that are not usable (1 = dead); grid × 1 or × channels.
  const Image<std::uint8_t>* dead = nullptr;
};

/// Merges the frames of one bracket into one photograph:
///   mean = Σ w_k x_k / Σ w_k − black,  variance = 1 / Σ w_k + Var[black],
///   x_k = scale (raw_k − pedestal) / (gain t_k),  w_k = 1 / Var[x_k]
/// with Var taken at one common estimate of all frames (the reason is in merge.cpp). A saturated sample has
/// weight exactly 0. A pixel is invalid (valid, mean and variance 0) if all its samples are saturated, if it
/// is dead, or if its black is invalid. shapes: 1..kMaxFrames frames, in any order, of channels × grid → grid
/// × channels. error: mean is unbiased to 0.02 σ, except if a frame is within ±2 σ of its saturation:
/// dropping saturated samples favours low ones, ≤ 0.4 σ of that frame's sample. variance is unbiased to 2 %.
/// It is estimated from the same samples, so one pixel's σ scatters by 1/(2√V), V [e⁻²] the variance of its
/// longest usable sample. Bit-equal for any number of threads and any instruction set. fails: bad_argument
/// (no frames or too many, exposure ≤ 0, scale not positive and finite, noise model unusable, empty grid),
/// size_mismatch, bad_value (NaN or infinity in black).
Result<Radiance> merge(std::span<const Frame> frames, Grid grid, int channels, const NoiseModel& noise,
                       const MergeOptions& options = {});

/// The same into a given result. Allocates nothing if `out` already has the right shape.
Result<void> merge_into(std::span<const Frame> frames, Grid grid, int channels, const NoiseModel& noise,
                        const MergeOptions& options, Radiance& out);

/// Mean of photographs of the same light (black brackets): mean = Σ x / n, variance = Σ Var[x] / n², over the
/// n valid ones of each value; valid where n ≥ 1. Their errors must be independent.
/// fails: bad_argument (none given), size_mismatch.
Result<Radiance> average(std::span<const Radiance> photographs);

}  // namespace symrig
