// SPDX-License-Identifier: Apache-2.0
// Compiled for every instruction set that Highway supports, and chosen at run time.
#include "calibration/pixel_map/stripe_light.hpp"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "calibration/pixel_map/stripe_kernels.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace symrig::calibration::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::CappedTag<float, kSteps>;

void shape_pixel(const Steps* scales, std::size_t bits, const Shape& shape, std::size_t left_out,
                 ShapedPixel& to) {
  const Lanes d;
  for (std::size_t part = 0; part < kSteps; part += hn::Lanes(d)) {
    auto square = hn::Zero(d);
    for (std::size_t bit = 0; bit < bits; ++bit) {
      auto sum = hn::Zero(d);
      if (bit != left_out)
        for (std::size_t s = 0; s < shape.size(); ++s)
          sum = hn::MulAdd(hn::Set(d, shape[s]), hn::LoadU(d, scales[bit * shape.size() + s].data() + part),
                           sum);
      hn::StoreU(sum, d, to.contrast[bit].data() + part);
      square = hn::MulAdd(sum, sum, square);
    }
    hn::StoreU(hn::Max(square, hn::Set(d, std::numeric_limits<float>::min())), d, to.square.data() + part);
  }
}

void sum_shape(const ScaleLanes* m, const float* d, std::size_t bits, float weight, ShapeSums& to) {
  const hn::CappedTag<float, kScales.size() + 1> lanes;
  for (std::size_t part = 0; part < kScales.size() + 1; part += hn::Lanes(lanes)) {
    const auto row = [&](auto factor) {
      auto sum = hn::Zero(lanes);
      for (std::size_t bit = 0; bit < bits; ++bit)
        sum = hn::MulAdd(hn::Set(lanes, weight * factor(bit)), hn::LoadU(lanes, m[bit].data() + part), sum);
      return sum;
    };
    for (std::size_t i = 0; i < kScales.size(); ++i)
      hn::StoreU(row([&](std::size_t bit) { return m[bit][i]; }), lanes, to.a[i].data() + part);
    hn::StoreU(row([&](std::size_t bit) { return d[bit]; }), lanes, to.b.data() + part);
  }
}

}  // namespace symrig::calibration::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::calibration {

HWY_EXPORT(shape_pixel);
HWY_EXPORT(sum_shape);

void shape_pixel(const Steps* scales, int bits, const Shape& shape, std::optional<int> left_out,
                 ShapedPixel& to) {
  HWY_DYNAMIC_DISPATCH(shape_pixel)
  (scales, static_cast<std::size_t>(bits), shape, static_cast<std::size_t>(left_out.value_or(kMaxBits)), to);
}

void sum_shape(const ScaleLanes* m, const float* d, int bits, float weight, ShapeSums& to) {
  HWY_DYNAMIC_DISPATCH(sum_shape)(m, d, static_cast<std::size_t>(bits), weight, to);
}

}  // namespace symrig::calibration
#endif  // HWY_ONCE
