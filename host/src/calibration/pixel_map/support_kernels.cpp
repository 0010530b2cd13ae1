// SPDX-License-Identifier: Apache-2.0
// Compiled for every instruction set that Highway supports, and chosen at run time. A lane is a pixel: the
// pixels of a row need the same comparisons.
#include "calibration/pixel_map/raw_map.hpp"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "calibration/pixel_map/support_kernels.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace symrig::calibration::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kMostLanes = 16;
using Lanes = hn::CappedTag<float, kMostLanes>;
using V = hn::Vec<Lanes>;

constexpr std::size_t kSlopes = std::size_t{2 * kSupportReach + 1} * (2 * kSupportReach + 1 - kSlopeApart);

/// Sorts `value` lane by lane: Batcher's odd-even merge sort, whose comparisons do not depend on the values
/// [Knuth98 5.2.2 M].
void sort_lanes(Lanes d, float (*value)[kMostLanes]) {
  constexpr std::size_t kPower = 16;  // the largest power of two below kSlopes
  for (std::size_t p = kPower; p > 0; p /= 2) {
    std::size_t r = 0, apart = p;
    for (std::size_t q = kPower;; q /= 2) {
      for (std::size_t i = 0; i + apart < kSlopes; ++i) {
        if ((i & p) != r) continue;
        const V a = hn::Load(d, value[i]), b = hn::Load(d, value[i + apart]);
        hn::Store(hn::Min(a, b), d, value[i]);
        hn::Store(hn::Max(a, b), d, value[i + apart]);
      }
      if (q == p) break;
      apart = q - p;
      r = p;
    }
  }
}

/// Median change of one axis for each camera pixel, downwards or to the right; 0 if no two pixels give it.
V median_slope(Lanes d, const float* position, std::ptrdiff_t stride, bool down) {
  HWY_ALIGN float value[kSlopes][kMostLanes];
  const int rows = down ? kSlopeApart : 0, cols = down ? 0 : kSlopeApart;
  const std::ptrdiff_t apart = rows * stride + cols;
  const V missing = hn::Set(d, std::numeric_limits<float>::infinity());
  V known = hn::Zero(d);
  std::size_t at = 0;
  for (int i = -kSupportReach; i <= kSupportReach - rows; ++i)
    for (int j = -kSupportReach; j <= kSupportReach - cols; ++j, ++at) {
      const float* const here = position + i * stride + j;
      const V change = hn::Sub(hn::LoadU(d, here + apart), hn::LoadU(d, here));
      const auto nan = hn::IsNaN(change);
      known = hn::Add(known, hn::IfThenZeroElse(nan, hn::Set(d, 1.0F)));
      hn::Store(hn::IfThenElse(nan, missing, change), d, value[at]);
    }
  sort_lanes(d, value);

  // Element known / 2 of each lane.
  V found = hn::Load(d, value[0]);
  for (std::size_t k = 1; 2 * k <= kSlopes; ++k)
    found =
        hn::IfThenElse(hn::Ge(known, hn::Set(d, static_cast<float>(2 * k))), hn::Load(d, value[k]), found);
  const V per_pixel = hn::Mul(found, hn::Set(d, 1.0F / kSlopeApart));
  return hn::IfThenElse(hn::Gt(known, hn::Zero(d)), per_pixel, hn::Zero(d));
}

void count_support(const float* col, const float* row, std::ptrdiff_t stride, std::size_t count,
                   float farthest, PixelSupport* to) {
  const Lanes d;
  const V one = hn::Set(d, 1.0F);
  for (std::size_t at = 0; at < count; at += hn::Lanes(d)) {
    const float* const x = col + at;
    const float* const y = row + at;
    const V x_down = median_slope(d, x, stride, true), x_right = median_slope(d, x, stride, false);
    const V y_down = median_slope(d, y, stride, true), y_right = median_slope(d, y, stride, false);
    const V own_x = hn::LoadU(d, x), own_y = hn::LoadU(d, y);
    V decoded = hn::Zero(d), agreeing = hn::Zero(d);
    for (int i = -kSupportReach; i <= kSupportReach; ++i)
      for (int j = -kSupportReach; j <= kSupportReach; ++j) {
        if (i == 0 && j == 0) continue;
        const V down = hn::Set(d, static_cast<float>(i)), right = hn::Set(d, static_cast<float>(j));
        const V there = hn::LoadU(d, x + i * stride + j);
        V dx = hn::NegMulAdd(down, x_down, hn::Sub(there, own_x));
        V dy = hn::NegMulAdd(down, y_down, hn::Sub(hn::LoadU(d, y + i * stride + j), own_y));
        dx = hn::NegMulAdd(right, x_right, dx);
        dy = hn::NegMulAdd(right, y_right, dy);
        decoded = hn::Add(decoded, hn::IfThenZeroElse(hn::IsNaN(there), one));
        const V square = hn::MulAdd(dx, dx, hn::Mul(dy, dy));
        agreeing = hn::Add(agreeing, hn::IfThenElseZero(hn::Le(square, hn::Set(d, farthest)), one));
      }
    HWY_ALIGN float both[2][kMostLanes];
    hn::Store(decoded, d, both[0]);
    hn::Store(agreeing, d, both[1]);
    for (std::size_t lane = 0; lane < hn::Lanes(d) && at + lane < count; ++lane)
      to[at + lane] = {both[0][lane], both[1][lane]};
  }
}

}  // namespace symrig::calibration::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::calibration {

HWY_EXPORT(count_support);

void count_support(const float* col, const float* row, std::ptrdiff_t stride, std::size_t count,
                   float farthest, PixelSupport* to) {
  HWY_DYNAMIC_DISPATCH(count_support)(col, row, stride, count, farthest, to);
}

}  // namespace symrig::calibration
#endif  // HWY_ONCE
