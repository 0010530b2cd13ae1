// SPDX-License-Identifier: Apache-2.0
// Compiled for every instruction set that Highway knows, and chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "hdr/merge_stream_kernel.cpp"  // NOLINT(cppcoreguidelines-macro-usage): Highway's protocol
#include "hdr/merge_kernel.hpp"

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

HWY_INLINE void accumulate(V value, float* into) {
  hn::StoreU(hn::Add(hn::LoadU(kFloat, into), value), kFloat, into);
}

void add_frame(const std::uint16_t* raw, std::size_t count, float pedestal, float saturation, float t,
               const StreamSums& into) {
  const std::size_t lanes = hn::Lanes(kFloat);
  const V zero_code = hn::Set(kFloat, pedestal);
  const V full = hn::Set(kFloat, saturation);
  const V time = hn::Set(kFloat, t);
  const V squared = hn::Mul(time, time);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const V code = hn::ConvertTo(kFloat, hn::PromoteTo(kInt, hn::LoadU(kCode, raw + i)));
    const auto usable = hn::Lt(code, full);
    const V d = hn::IfThenElseZero(usable, hn::Sub(code, zero_code));
    accumulate(d, into.sum + i);
    accumulate(hn::IfThenElseZero(usable, time), into.time + i);
    accumulate(hn::Mul(d, time), into.weighted_sum + i);
    accumulate(hn::IfThenElseZero(usable, squared), into.weighted_time + i);
  }
  for (; i < count; ++i) {  // the same arithmetic, one by one
    const auto code = static_cast<float>(raw[i]);
    if (code >= saturation) continue;
    const float d = code - pedestal;
    into.sum[i] += d;
    into.time[i] += t;
    const float product = d * t, square = t * t;
    into.weighted_sum[i] += product;
    into.weighted_time[i] += square;
  }
}

}  // namespace symrig::hdr::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::hdr {
HWY_EXPORT(add_frame);
void add_frame(const std::uint16_t* raw, std::size_t count, float pedestal, float saturation, float t,
               const StreamSums& into) noexcept {
  HWY_DYNAMIC_DISPATCH(add_frame)(raw, count, pedestal, saturation, t, into);
}
}  // namespace symrig::hdr
#endif
