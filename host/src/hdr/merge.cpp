// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/merge.hpp"

#include "hdr/merge_checks.hpp"
#include "hdr/merge_kernel.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

// Why all frames use one estimate of the radiance. The best weight of sample k is 1 / Var[x_k]. Its shot
// noise depends on the unknown radiance. If each sample supplied its own estimate, a sample that is low by
// chance would get a small variance, and its large weight would pull the mean down. So the radiance is first
// estimated from all usable samples together: total electrons over total time, the maximum-likelihood
// estimate if shot noise dominates. Every weight uses this estimate. The remaining correlation is of second
// order: d mean / d estimate vanishes where the samples agree.

namespace symrig {
namespace {

constexpr std::size_t kGrain = std::size_t{1} << 14;  // pixels of one task, and the length of Nothing
/// Results of at least this size [bytes] bypass the cache: they would not stay in it until they are read.
constexpr std::size_t kStreamed = std::size_t{8} << 20;

using hdr::bad_argument;

Result<void> check_frames(std::span<const Frame> frames, std::size_t values) {
  if (frames.empty() || frames.size() > kMaxFrames)
    return bad_argument(
        fmt::format("the bracket has {} frames; it must have 1 to {}", frames.size(), kMaxFrames));
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (frames[k].exposure <= Nanoseconds{0})
      return bad_argument(
          fmt::format("the exposure of frame {} is {} ns; it must be above 0", k, frames[k].exposure.count()),
          "give the shutter time measured from the pulse");
    if (frames[k].raw.size() != values)
      return Error{ErrorCode::size_mismatch, fmt::format("frame {} has {} samples; the grid needs {}", k,
                                                         frames[k].raw.size(), values)};
  }
  return {};
}

Result<void> check(std::span<const Frame> frames, Grid grid, int channels, const NoiseModel& noise,
                   const MergeOptions& options) {
  SYMRIG_CHECK(hdr::check_sensor(grid, channels, noise));
  SYMRIG_CHECK(
      check_frames(frames, static_cast<std::size_t>(grid.size()) * static_cast<std::size_t>(channels)));
  return hdr::check_options(options, grid, channels);
}

/// Times are in units of the longest exposure, which keeps every float near 1.
hdr::BracketConstants constants(std::span<const Frame> frames, const NoiseModel& noise, double scale) {
  const auto longest = std::ranges::max(frames, {}, &Frame::exposure).exposure;
  hdr::BracketConstants bracket;
  bracket.frames = frames.size();
  bracket.pedestal = static_cast<float>(noise.pedestal());
  bracket.saturation = static_cast<float>(noise.saturation_code());
  bracket.electrons_per_code = static_cast<float>(1 / noise.gain());
  bracket.scale = static_cast<float>(scale / seconds(longest));
  bracket.lowest_rate = static_cast<float>(-noise.gain() * noise.floor_variance() / 2);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const double t = seconds(frames[k].exposure) / seconds(longest);
    bracket.time[k] = static_cast<float>(t);
    bracket.floor[k] = static_cast<float>(noise.gain() * noise.floor_variance() / t);
  }
  return bracket;
}

/// Zeros for the case without a black photograph and without dead pixels.
struct Nothing {
  std::vector<float> zero = std::vector<float>(kGrain, 0.0F);
  std::vector<std::uint8_t> valid = std::vector<std::uint8_t>(kGrain, 1);
  std::vector<std::uint8_t> dead = std::vector<std::uint8_t>(kGrain, 0);
};

/// Pixels [begin, begin + count) of one channel: what one task merges.
struct MergeTask {
  int channel;
  std::size_t begin, count;
};

const std::uint8_t* dead_flags(const Image<std::uint8_t>* dead, const MergeTask& piece,
                               const std::uint8_t* none) {
  if (dead == nullptr) return none;
  return dead->plane(dead->channels() == 1 ? 0 : piece.channel).data() + piece.begin;
}

hdr::MergeRange range_of(std::span<const Frame> frames, const MergeOptions& options, const MergeTask& piece,
                         Radiance& out) {
  static const Nothing nothing;
  const std::size_t pixels = out.mean.grid().size();
  const std::size_t at = static_cast<std::size_t>(piece.channel) * pixels + piece.begin;
  const Radiance* black = options.black;
  hdr::MergeRange range;
  for (std::size_t k = 0; k < frames.size(); ++k) range.raw[k] = frames[k].raw.data() + at;
  range.black = black ? black->mean.values().data() + at : nothing.zero.data();
  range.black_variance = black ? black->variance.values().data() + at : nothing.zero.data();
  range.black_valid = black ? black->valid.values().data() + at : nothing.valid.data();
  range.dead = dead_flags(options.dead, piece, nothing.dead.data());
  range.mean = out.mean.values().data() + at;
  range.variance = out.variance.values().data() + at;
  range.valid = out.valid.values().data() + at;
  range.count = piece.count;
  return range;
}

bool shaped(const Radiance& radiance, Grid grid, int channels) {
  const auto fits = [&](const auto& image) { return image.grid() == grid && image.channels() == channels; };
  return fits(radiance.mean) && fits(radiance.variance) && fits(radiance.valid);
}

}  // namespace

Result<void> merge_into(std::span<const Frame> frames, Grid grid, int channels, const NoiseModel& noise,
                        const MergeOptions& options, Radiance& out) {
  SYMRIG_CHECK(check(frames, grid, channels, noise, options));
  if (!shaped(out, grid, channels))
    out = {Image<float>(grid, channels), Image<float>(grid, channels), Image<std::uint8_t>(grid, channels)};
  const auto bracket = constants(frames, noise, options.scale);
  const std::size_t pixels = grid.size();
  const std::size_t pieces = (pixels + kGrain - 1) / kGrain;  // of one channel
  const std::size_t bytes = out.mean.values().size() * (2 * sizeof(float) + 1);
  const auto stores = bytes >= kStreamed ? hdr::Stores::streamed : hdr::Stores::cached;
  std::atomic<bool> finite = true;
  tbb::parallel_for(std::size_t{0}, pieces * static_cast<std::size_t>(channels), [&](std::size_t task) {
    const std::size_t begin = task % pieces * kGrain;
    const MergeTask piece{static_cast<int>(task / pieces), begin, std::min(kGrain, pixels - begin)};
    if (!hdr::merge_range(bracket, range_of(frames, options, piece, out), stores)) finite = false;
  });
  if (!finite) return Error{ErrorCode::bad_value, "the black photograph contains NaN or infinity"};
  return {};
}

Result<Radiance> merge(std::span<const Frame> frames, Grid grid, int channels, const NoiseModel& noise,
                       const MergeOptions& options) {
  Radiance out;
  SYMRIG_CHECK(merge_into(frames, grid, channels, noise, options, out));
  return out;
}

Result<Radiance> average(std::span<const Radiance> photographs) {
  if (photographs.empty()) return bad_argument("cannot average zero photographs");
  const Grid grid = photographs.front().mean.grid();
  const int channels = photographs.front().mean.channels();
  Radiance sum{Image<float>(grid, channels), Image<float>(grid, channels),
               Image<std::uint8_t>(grid, channels)};
  std::vector<float> count(sum.mean.values().size(), 0.0F);
  for (const Radiance& photograph : photographs) {
    if (!shaped(photograph, grid, channels))
      return Error{ErrorCode::size_mismatch, fmt::format("cannot average photographs of {} and {}",
                                                         to_string(grid), to_string(photograph.mean.grid()))};
    for (std::size_t i = 0; i < count.size(); ++i) {
      if (!photograph.valid.values()[i]) continue;
      sum.mean.values()[i] += photograph.mean.values()[i];
      sum.variance.values()[i] += photograph.variance.values()[i];
      count[i] += 1;
    }
  }
  for (std::size_t i = 0; i < count.size(); ++i) {
    if (count[i] == 0) continue;
    sum.mean.values()[i] /= count[i];
    sum.variance.values()[i] /= count[i] * count[i];
    sum.valid.values()[i] = 1;
  }
  return sum;
}

}  // namespace symrig
