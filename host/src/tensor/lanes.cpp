// SPDX-License-Identifier: Apache-2.0
// Compiled for every instruction set that Highway knows and chosen at run time.
#include "symrig/tensor/internal/kernels.hpp"

#include <hwy/cache_control.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tensor/lanes.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace symrig::tensor::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

void interleave(const float* const* lanes, std::size_t n, float* p) {
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < kBatch; ++k) p[i * kBatch + k] = lanes[k][i];
}

void deinterleave(const float* p, std::size_t n, float* const* lanes) {
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < kBatch; ++k) lanes[k][i] = p[i * kBatch + k];
}

#else

using Four = hn::FixedTag<float, 4>;
using Pairs = hn::FixedTag<double, 2>;  // of floats, moved together

/// The 4 x 4 matrix with rows a, b, c, d, transposed in place.
HWY_INLINE void transpose(hn::Vec<Four>& a, hn::Vec<Four>& b, hn::Vec<Four>& c, hn::Vec<Four>& d) {
  const Four f;
  const Pairs p;
  const auto ab_low = hn::BitCast(p, hn::InterleaveLower(f, a, b));
  const auto ab_high = hn::BitCast(p, hn::InterleaveUpper(f, a, b));
  const auto cd_low = hn::BitCast(p, hn::InterleaveLower(f, c, d));
  const auto cd_high = hn::BitCast(p, hn::InterleaveUpper(f, c, d));
  a = hn::BitCast(f, hn::InterleaveLower(p, ab_low, cd_low));
  b = hn::BitCast(f, hn::InterleaveUpper(p, ab_low, cd_low));
  c = hn::BitCast(f, hn::InterleaveLower(p, ab_high, cd_high));
  d = hn::BitCast(f, hn::InterleaveUpper(p, ab_high, cd_high));
}

void interleave(const float* const* lanes, std::size_t n, float* p) {
  const Four f;
  std::size_t i = 0;
  for (; i + 4 <= n; i += 4)
    for (std::size_t k = 0; k < kBatch; k += 4) {
      auto a = hn::LoadU(f, lanes[k] + i);
      auto b = hn::LoadU(f, lanes[k + 1] + i);
      auto c = hn::LoadU(f, lanes[k + 2] + i);
      auto d = hn::LoadU(f, lanes[k + 3] + i);
      transpose(a, b, c, d);
      float* const to = p + i * kBatch + k;
      hn::StoreU(a, f, to);
      hn::StoreU(b, f, to + kBatch);
      hn::StoreU(c, f, to + 2 * kBatch);
      hn::StoreU(d, f, to + 3 * kBatch);
    }
  for (; i < n; ++i)
    for (std::size_t k = 0; k < kBatch; ++k) p[i * kBatch + k] = lanes[k][i];
}

void deinterleave(const float* p, std::size_t n, float* const* lanes) {
  const Four f;
  std::size_t i = 0;
  for (; i + 4 <= n; i += 4)
    for (std::size_t k = 0; k < kBatch; k += 4) {
      const float* const from = p + i * kBatch + k;
      auto a = hn::LoadU(f, from);
      auto b = hn::LoadU(f, from + kBatch);
      auto c = hn::LoadU(f, from + 2 * kBatch);
      auto d = hn::LoadU(f, from + 3 * kBatch);
      transpose(a, b, c, d);
      hn::StoreU(a, f, lanes[k] + i);
      hn::StoreU(b, f, lanes[k + 1] + i);
      hn::StoreU(c, f, lanes[k + 2] + i);
      hn::StoreU(d, f, lanes[k + 3] + i);
    }
  for (; i < n; ++i)
    for (std::size_t k = 0; k < kBatch; ++k) lanes[k][i] = p[i * kBatch + k];
}

#endif

}  // namespace symrig::tensor::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::tensor {

HWY_EXPORT(interleave);
HWY_EXPORT(deinterleave);

// Tree order jumps between rows of the picture, which no hardware prefetcher predicts. Software prefetch
// makes this loop twice as fast, faster than the machine's gather instruction. Sixteen pixels of tree order
// are usually 4 x 4 pixels of the picture: four rows, whose first pixels have these offsets.
void gather(const std::int32_t* order, const float* from, float* to, std::size_t n) {
  constexpr std::size_t kGroup = 16;
  constexpr std::size_t kAhead = 256;
  std::size_t i = 0;
  for (; i + kAhead + kGroup <= n; i += kGroup) {
    for (const std::size_t first : {0, 2, 8, 10}) hwy::Prefetch(from + order[i + kAhead + first]);
    for (std::size_t k = i; k < i + kGroup; ++k) to[k] = from[order[k]];
  }
  for (; i < n; ++i) to[i] = from[order[i]];
}

void interleave(const LaneRows& lanes, std::size_t n, float* p) {
  HWY_DYNAMIC_DISPATCH(interleave)(lanes.data(), n, p);
}

void deinterleave(const float* p, std::size_t n, const LaneRowsOut& lanes) {
  HWY_DYNAMIC_DISPATCH(deinterleave)(p, n, lanes.data());
}

}  // namespace symrig::tensor
#endif  // HWY_ONCE
