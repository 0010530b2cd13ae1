// SPDX-License-Identifier: Apache-2.0
// Compiled once for each instruction set; merge_range picks the best one at run time (Highway's dynamic
// dispatch).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "hdr/merge_kernel.cpp"  // NOLINT(cppcoreguidelines-macro-usage): Highway's protocol
#include "hdr/merge_kernel.hpp"

#include <algorithm>

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

/// Electrons per T that all usable samples agree on: Σ d_k / (gain Σ t_k). Signed: cutting noise off at 0
/// would overstate the variance of dark pixels. The lower limit keeps every weight positive.
template <std::size_t K>
HWY_INLINE V shared_estimate(const BracketConstants& bracket, const Samples<K>& samples) {
  V value = samples.value[0];
  V time = samples.time[0];
  for (std::size_t k = 1; k < K; ++k) {
    value = hn::Add(value, samples.value[k]);
    time = hn::Add(time, samples.time[k]);
  }
  const V tiny = hn::Set(kFloat, 1e-30F);  // no usable sample: 0 / tiny, and every weight is 0
  const V rate = hn::Div(hn::Mul(value, hn::Set(kFloat, bracket.electrons_per_code)), hn::Max(time, tiny));
  return hn::Max(rate, hn::Set(kFloat, bracket.lowest_rate));
}

/// Not 0 in the lanes where a value is NaN or infinity: its exponent bits are all set.
HWY_INLINE hn::Vec<decltype(kInt)> not_finite(V value) {
  const auto exponent = hn::Set(kInt, 0x7F800000);
  return hn::VecFromMask(kInt, hn::Eq(hn::And(hn::BitCast(kInt, value), exponent), exponent));
}

/// Lanes() pixels at `at`. Not 0 in the lanes whose black is not finite.
template <std::size_t K>
HWY_INLINE hn::Vec<decltype(kInt)> merge_lanes(const BracketConstants& bracket, const MergeRange& range,
                                               std::size_t at) {
  Samples<K> samples;
  load(bracket, range, at, samples);
  const V rate = shared_estimate(bracket, samples);
  V sum = hn::Zero(kFloat);
  V weights = hn::Zero(kFloat);
  for (std::size_t k = 0; k < K; ++k) {
    // w_k = t_k² / (rate t_k + floor) = t_k / (rate + floor / t_k); t_k = 0 makes the weight of a saturated
    // sample 0.
    const V weight = hn::Div(samples.time[k], hn::Add(rate, hn::Set(kFloat, bracket.floor[k])));
    sum = hn::Add(sum, hn::Mul(weight, hn::Mul(samples.value[k], hn::Set(kFloat, bracket.per_code[k]))));
    weights = hn::Add(weights, weight);
  }
  const V zero = hn::Zero(kFloat);
  const auto black_valid =
      hn::Ne(hn::ConvertTo(kFloat, hn::PromoteTo(kInt, hn::LoadU(kFlag, range.black_valid + at))), zero);
  const auto valid = hn::And(hn::Gt(weights, zero), black_valid);
  const V scale = hn::Set(kFloat, bracket.scale);
  const V per_weight = hn::Div(scale, weights);
  const V black = hn::LoadU(kFloat, range.black + at);
  const V black_variance = hn::LoadU(kFloat, range.black_variance + at);
  const V mean = hn::Sub(hn::Mul(sum, per_weight), black);
  const V variance = hn::Add(hn::Mul(scale, per_weight), black_variance);
  hn::StoreU(hn::IfThenElseZero(valid, mean), kFloat, range.mean + at);
  hn::StoreU(hn::IfThenElseZero(valid, variance), kFloat, range.variance + at);
  const auto flag = hn::ConvertTo(kInt, hn::IfThenElseZero(valid, hn::Set(kFloat, 1)));
  hn::StoreU(hn::DemoteTo(kFlag, flag), kFlag, range.valid + at);
  return hn::Or(not_finite(black), not_finite(black_variance));
}

/// The last count < Lanes() pixels run through the same vector code, on padded copies: same arithmetic, same
/// bits.
template <std::size_t K>
bool merge_tail(const BracketConstants& bracket, const MergeRange& range, std::size_t at) {
  constexpr std::size_t kLanes = hn::MaxLanes(D());
  const std::size_t count = range.count - at;
  HWY_ALIGN std::uint16_t raw[K][kLanes] = {};
  HWY_ALIGN float black[kLanes] = {}, black_variance[kLanes] = {}, mean[kLanes], variance[kLanes];
  HWY_ALIGN std::uint8_t black_valid[kLanes] = {}, valid[kLanes];
  MergeRange tail;
  for (std::size_t k = 0; k < K; ++k) {
    std::copy_n(range.raw[k] + at, count, raw[k]);
    tail.raw[k] = raw[k];
  }
  std::copy_n(range.black + at, count, black);
  std::copy_n(range.black_variance + at, count, black_variance);
  std::copy_n(range.black_valid + at, count, black_valid);
  tail.black = black;
  tail.black_variance = black_variance;
  tail.black_valid = black_valid;
  tail.mean = mean;
  tail.variance = variance;
  tail.valid = valid;
  const auto bad = merge_lanes<K>(bracket, tail, 0);
  std::copy_n(mean, count, range.mean + at);
  std::copy_n(variance, count, range.variance + at);
  std::copy_n(valid, count, range.valid + at);
  return hn::AllTrue(kInt, hn::Eq(bad, hn::Zero(kInt)));
}

template <std::size_t K>
bool merge_frames(const BracketConstants& bracket, const MergeRange& range) {
  const std::size_t lanes = hn::Lanes(kFloat);
  std::size_t at = 0;
  auto bad = hn::Zero(kInt);
  for (; at + lanes <= range.count; at += lanes) bad = hn::Or(bad, merge_lanes<K>(bracket, range, at));
  const bool finite = hn::AllTrue(kInt, hn::Eq(bad, hn::Zero(kInt)));
  return at < range.count ? merge_tail<K>(bracket, range, at) && finite : finite;
}

bool merge_range(const BracketConstants& bracket, const MergeRange& range) {
  switch (bracket.frames) {  // a constant number of frames keeps every sample in a register
    case 1:
      return merge_frames<1>(bracket, range);
    case 2:
      return merge_frames<2>(bracket, range);
    case 3:
      return merge_frames<3>(bracket, range);
    case 4:
      return merge_frames<4>(bracket, range);
    case 5:
      return merge_frames<5>(bracket, range);
    case 6:
      return merge_frames<6>(bracket, range);
    case 7:
      return merge_frames<7>(bracket, range);
    default:
      return merge_frames<8>(bracket, range);
  }
}

}  // namespace symrig::hdr::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::hdr {
HWY_EXPORT(merge_range);
bool merge_range(const BracketConstants& bracket, const MergeRange& range) noexcept {
  return HWY_DYNAMIC_DISPATCH(merge_range)(bracket, range);
}
}  // namespace symrig::hdr
#endif
