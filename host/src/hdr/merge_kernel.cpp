// SPDX-License-Identifier: Apache-2.0
// Compiled once for each instruction set. merge_range chooses the best one at run time (Highway's dynamic
// dispatch).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "hdr/merge_kernel.cpp"  // NOLINT(cppcoreguidelines-macro-usage): Highway's protocol
#include "hdr/merge_kernel.hpp"

#include <algorithm>

#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>  // must stand before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace symrig::hdr::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;
constexpr D kFloat;
constexpr hn::RebindToSigned<D> kInt;
constexpr hn::Rebind<std::uint16_t, D> kCode;
constexpr hn::Rebind<std::uint8_t, D> kFlag;

/// The samples of Lanes() pixels: d_k = code − pedestal, or 0 where saturated; t_k, or 0 where saturated.
template <std::size_t K>
struct Samples {
  V value[K];
  V time[K];
};

template <std::size_t K>
HWY_INLINE void load(const BracketConstants& bracket, const MergeRange& range, std::size_t at,
                     Samples<K>& samples) {
  const V pedestal = hn::Set(kFloat, bracket.pedestal);
  const V saturation = hn::Set(kFloat, bracket.saturation);
  for (std::size_t k = 0; k < K; ++k) {
    const V code = hn::ConvertTo(kFloat, hn::PromoteTo(kInt, hn::LoadU(kCode, range.raw[k] + at)));
    const auto usable = hn::Lt(code, saturation);
    samples.value[k] = hn::IfThenElseZero(usable, hn::Sub(code, pedestal));
    samples.time[k] = hn::IfThenElseZero(usable, hn::Set(kFloat, bracket.time[k]));
  }
}

/// The common estimate of all usable samples: Σ d_k and Σ t_k. Their ratio is the rate at which every weight
/// is taken. It is signed: cutting noise off at 0 would overstate the variance of dark pixels. The lower
/// limit keeps every weight positive.
struct Shared {
  V value;
  V time;
};

template <std::size_t K>
HWY_INLINE Shared shared_estimate(const BracketConstants& bracket, const Samples<K>& samples) {
  V value = samples.value[0];
  V time = samples.time[0];
  for (std::size_t k = 1; k < K; ++k) {
    value = hn::Add(value, samples.value[k]);
    time = hn::Add(time, samples.time[k]);
  }
  time = hn::Max(time, hn::Set(kFloat, 1e-30F));  // no usable sample: divisors stay above 0
  return {hn::Max(value, hn::Mul(time, hn::Set(kFloat, bracket.lowest_rate))), time};
}

/// mean = e Σ d_k r_k / Σ t_k r_k and variance = e / (τ Σ t_k r_k) in units of scale, e = 1 / gain.
/// This is Σ w_k x_k / Σ w_k and 1 / Σ w_k with x_k = e d_k / t_k and w_k = t_k / (e D / τ + floor / t_k), D
/// = Σ d_k and τ = Σ t_k. The common factor of all weights is taken out, so that K + 1 divisions suffice
/// (r_k = 1 / (D + gain floor τ / t_k)). d_k = t_k = 0 excludes a saturated sample.
template <std::size_t K>
HWY_INLINE void weigh(const BracketConstants& bracket, const Samples<K>& samples, V& mean, V& variance,
                      hn::Mask<D>& any) {
  const Shared shared = shared_estimate(bracket, samples);
  V sum = hn::Zero(kFloat);
  V weights = hn::Zero(kFloat);
  for (std::size_t k = 0; k < K; ++k) {
    const V floor = hn::Mul(shared.time, hn::Set(kFloat, bracket.floor[k]));
    const V reciprocal = hn::Div(hn::Set(kFloat, 1), hn::Add(shared.value, floor));
    sum = hn::Add(sum, hn::Mul(samples.value[k], reciprocal));
    weights = hn::Add(weights, hn::Mul(samples.time[k], reciprocal));
  }
  any = hn::Gt(weights, hn::Zero(kFloat));
  const V each = hn::Div(hn::Set(kFloat, bracket.scale), hn::Mul(shared.time, weights));
  const V unit = hn::Mul(each, hn::Set(kFloat, bracket.electrons_per_code));
  mean = hn::Mul(hn::Mul(shared.time, sum), unit);
  variance = hn::Mul(hn::Set(kFloat, bracket.scale), unit);
}

/// |value| as an integer: NaN and infinity have all exponent bits set, so they are at kNotFinite or above.
using Bits = hn::Vec<decltype(kInt)>;
constexpr std::int32_t kNotFinite = 0x7F800000;
HWY_INLINE Bits magnitude(V value) {
  return hn::And(hn::BitCast(kInt, value), hn::Set(kInt, 0x7FFFFFFF));
}
HWY_INLINE bool all_finite(Bits largest) {
  return hn::AllTrue(kInt, hn::Lt(largest, hn::Set(kInt, kNotFinite)));
}

HWY_INLINE hn::Mask<D> flagged(const std::uint8_t* flags) {
  const auto wide = hn::PromoteTo(kInt, hn::LoadU(kFlag, flags));
  return hn::RebindMask(kFloat, hn::Ne(wide, hn::Zero(kInt)));
}

template <Stores S>
HWY_INLINE void store(V value, float* to) {
  if constexpr (S == Stores::streamed)
    hn::Stream(value, kFloat, to);
  else
    hn::StoreU(value, kFloat, to);
}

/// Eleven streams are more than the hardware prefetchers can follow, and these restart at each page of
/// memory. After the end of a range this prefetches lines that are not needed, which has no effect on the
/// result.
template <std::size_t K>
HWY_INLINE void fetch_ahead(const MergeRange& range, std::size_t at) {
  constexpr std::size_t kAhead = 512;  // pixels: the time that main memory takes to answer
  for (std::size_t k = 0; k < K; ++k) hwy::Prefetch(range.raw[k] + at + kAhead);
  hwy::Prefetch(range.black + at + kAhead);
  hwy::Prefetch(range.black_variance + at + kAhead);
  hwy::Prefetch(range.black_valid + at + kAhead);
  hwy::Prefetch(range.dead + at + kAhead);
  hwy::Prefetch(range.valid + at + kAhead);
}

/// Merges Lanes() pixels at `at`. largest: becomes at least the magnitude of their black and its variance.
template <std::size_t K, Stores S>
HWY_INLINE void merge_lanes(const BracketConstants& bracket, const MergeRange& range, std::size_t at,
                            Bits& largest) {
  Samples<K> samples;
  load(bracket, range, at, samples);
  V mean, variance;
  hn::Mask<D> any;
  weigh(bracket, samples, mean, variance, any);
  const auto known = hn::AndNot(flagged(range.dead + at), flagged(range.black_valid + at));
  const auto valid = hn::And(any, known);
  const V black = hn::LoadU(kFloat, range.black + at);
  const V black_variance = hn::LoadU(kFloat, range.black_variance + at);
  store<S>(hn::IfThenElseZero(valid, hn::Sub(mean, black)), range.mean + at);
  store<S>(hn::IfThenElseZero(valid, hn::Add(variance, black_variance)), range.variance + at);
  const auto flag = hn::IfThenElseZero(hn::RebindMask(kInt, valid), hn::Set(kInt, 1));
  hn::StoreU(hn::DemoteTo(kFlag, flag), kFlag, range.valid + at);
  largest = hn::Max(largest, hn::Max(magnitude(black), magnitude(black_variance)));
}

/// `count` < Lanes() pixels at `at` run through the same vector code, on padded copies: same arithmetic, same
/// bits.
template <std::size_t K>
bool merge_few(const BracketConstants& bracket, const MergeRange& range, std::size_t at, std::size_t count) {
  constexpr std::size_t kLanes = hn::MaxLanes(D());
  HWY_ALIGN std::uint16_t raw[K][kLanes] = {};
  HWY_ALIGN float black[kLanes] = {}, black_variance[kLanes] = {}, mean[kLanes], variance[kLanes];
  HWY_ALIGN std::uint8_t black_valid[kLanes] = {}, dead[kLanes] = {}, valid[kLanes];
  MergeRange few;
  for (std::size_t k = 0; k < K; ++k) {
    std::copy_n(range.raw[k] + at, count, raw[k]);
    few.raw[k] = raw[k];
  }
  std::copy_n(range.black + at, count, black);
  std::copy_n(range.black_variance + at, count, black_variance);
  std::copy_n(range.black_valid + at, count, black_valid);
  std::copy_n(range.dead + at, count, dead);
  few.black = black;
  few.black_variance = black_variance;
  few.black_valid = black_valid;
  few.dead = dead;
  few.mean = mean;
  few.variance = variance;
  few.valid = valid;
  Bits largest = hn::Zero(kInt);
  merge_lanes<K, Stores::cached>(bracket, few, 0, largest);
  std::copy_n(mean, count, range.mean + at);
  std::copy_n(variance, count, range.variance + at);
  std::copy_n(valid, count, range.valid + at);
  return all_finite(largest);
}

/// Pixels before the first whole vector that starts on a vector boundary in memory.
std::size_t pixels_to_boundary(const float* to) {
  const std::size_t bytes = hn::Lanes(kFloat) * sizeof(float);
  return (bytes - reinterpret_cast<std::uintptr_t>(to) % bytes) % bytes / sizeof(float);
}

/// Streamed stores need both outputs on a vector boundary; the pixels before it go through merge_few.
template <std::size_t K, Stores S>
bool merge_frames(const BracketConstants& bracket, const MergeRange& range) {
  const std::size_t lanes = hn::Lanes(kFloat);
  std::size_t at = 0;
  bool finite = true;
  if constexpr (S == Stores::streamed) {
    at = std::min(pixels_to_boundary(range.mean), range.count);
    if (at > 0) finite = merge_few<K>(bracket, range, 0, at);
  }
  Bits largest = hn::Zero(kInt);
  for (; at + lanes <= range.count; at += lanes) {
    fetch_ahead<K>(range, at);
    merge_lanes<K, S>(bracket, range, at, largest);
  }
  if constexpr (S == Stores::streamed) hwy::FlushStream();
  if (at < range.count) finite = merge_few<K>(bracket, range, at, range.count - at) && finite;
  return finite && all_finite(largest);
}

template <std::size_t K>
bool merge_bracket(const BracketConstants& bracket, const MergeRange& range, Stores stores) {
  const bool alike = pixels_to_boundary(range.mean) == pixels_to_boundary(range.variance);
  return stores == Stores::streamed && alike ? merge_frames<K, Stores::streamed>(bracket, range)
                                             : merge_frames<K, Stores::cached>(bracket, range);
}

bool merge_range(const BracketConstants& bracket, const MergeRange& range, Stores stores) {
  switch (bracket.frames) {  // with a constant number of frames, every sample stays in a register
    case 1:
      return merge_bracket<1>(bracket, range, stores);
    case 2:
      return merge_bracket<2>(bracket, range, stores);
    case 3:
      return merge_bracket<3>(bracket, range, stores);
    case 4:
      return merge_bracket<4>(bracket, range, stores);
    case 5:
      return merge_bracket<5>(bracket, range, stores);
    case 6:
      return merge_bracket<6>(bracket, range, stores);
    case 7:
      return merge_bracket<7>(bracket, range, stores);
    default:
      return merge_bracket<8>(bracket, range, stores);
  }
}

}  // namespace symrig::hdr::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::hdr {
HWY_EXPORT(merge_range);
bool merge_range(const BracketConstants& bracket, const MergeRange& range, Stores stores) noexcept {
  return HWY_DYNAMIC_DISPATCH(merge_range)(bracket, range, stores);
}
}  // namespace symrig::hdr
#endif
