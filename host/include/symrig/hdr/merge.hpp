// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

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

/// Merges any number of frames one by one. A frame can be freed after it was added. Memory: four floats a
/// pixel for any number of frames.
///   mean = (a Σ d_k + b Σ t_k d_k) / (a Σ t_k + b Σ t_k²)
/// over the usable samples d_k = code − pedestal; the variance is that of this mean. The best weight of a
/// sample is h(t_k) = t_k / Var[d_k]. The line a + b t replaces it with the least increase of variance. h is
/// taken at the common rate Σ d / Σ t of all usable samples (the reason is in merge.cpp). error: with one or
/// two different exposures the weights are those of merge(). With more, the variance is at most 5 % above the
/// Cramér-Rao bound if neighbouring exposures have a ratio of 2 or more.
class MergeStream {
 public:
  /// exposures: those of all frames to come, in any order. Planned values suffice: they only affect the
  /// weights. fails: bad_argument (no exposures, noise model unusable, empty grid).
  static Result<MergeStream> begin(Grid grid, int channels, const NoiseModel& noise,
                                   std::span<const Nanoseconds> exposures);

  /// fails: size_mismatch, bad_argument (exposure ≤ 0).
  Result<void> add(const Frame& frame);
  /// Call it after the last add().  fails: as merge().
  Result<Radiance> finish(const MergeOptions& options = {}) const;

  int frames() const { return frames_; }

  /// Frames of one exposure, as planned.
  struct Group {
    double time;   ///< in units of the longest exposure
    double count;  ///< number of frames
    double total;  ///< Σ t of all frames that are not longer
  };

 private:
  MergeStream(Grid grid, int channels, const NoiseModel& noise);
  Grid grid_;
  int channels_;
  NoiseModel noise_;
  double unit_ = 1;            // the longest exposure planned [s]
  std::vector<Group> groups_;  // ascending
  int frames_ = 0;
  Image<float> sum_, time_, weighted_sum_, weighted_time_;  // Σd, Σt, Σtd, Σt²
};

/// The ratio of two frames of a bracket, from pixels that both see well.
struct ExposureRatio {
  std::size_t shorter = 0, longer = 0;  ///< numbers of the frames
  double stated = 1;                    ///< ratio of their stated exposures
  double seen = 1;                      ///< ratio of their pixels
  double sigma = 0;                     ///< standard error of seen, relative
  std::int64_t pixels = 0;              ///< number of pixels that both see well
  double imperfect = 0.005;             ///< what imperfect shutters and sensors can cause, relative

  /// True if the stated ratio is wrong: it differs by more than 5 standard errors and by more than
  /// `imperfect`.
  bool wrong() const;
  /// "frame 2 is 7.62 times frame 1 by its pixels (±0.01), 8 times by its exposures: off by 4.8 %"
  std::string to_string() const;
};

/// Ratios of neighbouring exposures from their overlap. Iterated total least squares gives the slope of
/// d_long = r d_short, with noise in both: r = Σ w d_long / Σ w d_short. A mean of ratios would be biased.
/// Saturated samples and samples below 5 σ are not used; a mean of both frames decides, so that the noise of
/// neither selects. Pairs with fewer than 64 common pixels are omitted from the result. fails: bad_argument
/// (exposures, noise model), size_mismatch.
Result<std::vector<ExposureRatio>> exposure_ratios(std::span<const Frame> frames, const NoiseModel& noise);

}  // namespace symrig
