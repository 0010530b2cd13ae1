// SPDX-License-Identifier: Apache-2.0
// The loops of applying a tensor that is not packed: to one pattern, and to sixteen at once, so that each
// factor is read only once. Compiled for every instruction set that Highway knows, and chosen at run time.
#include "symrig/tensor/internal/kernels.hpp"

#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tensor/kernels.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace symrig::tensor::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::ScalableTag<float>;

/// Loads the last n < lanes values and fills with zeros.
HWY_INLINE hn::Vec<Lanes> load_tail(Lanes d, const float* from, std::size_t n) {
  return hn::MaskedLoad(hn::FirstN(d, n), d, from);
}

float dot(const float* a, const float* b, std::size_t n) {
  const Lanes d;
  const std::size_t lanes = hn::Lanes(d);
  auto even = hn::Zero(d);
  auto odd = hn::Zero(d);
  std::size_t i = 0;
  for (; i + 2 * lanes <= n; i += 2 * lanes) {
    even = hn::MulAdd(hn::LoadU(d, a + i), hn::LoadU(d, b + i), even);
    odd = hn::MulAdd(hn::LoadU(d, a + i + lanes), hn::LoadU(d, b + i + lanes), odd);
  }
  for (; i < n; i += lanes) {
    const std::size_t left = n - i < lanes ? n - i : lanes;
    even = hn::MulAdd(load_tail(d, a + i, left), load_tail(d, b + i, left), even);
  }
  return hn::GetLane(hn::SumOfLanes(d, hn::Add(even, odd)));
}

void add_scaled(float w, const float* a, float* y, std::size_t n) {
  const Lanes d;
  const std::size_t lanes = hn::Lanes(d);
  const auto weight = hn::Set(d, w);
  std::size_t i = 0;
  for (; i + lanes <= n; i += lanes)
    hn::StoreU(hn::MulAdd(weight, hn::LoadU(d, a + i), hn::LoadU(d, y + i)), d, y + i);
  for (; i < n; ++i) y[i] += w * a[i];
}

float add_scaled_and_dot(float w, const float* a, const float* p, float* y, std::size_t n) {
  const Lanes d;
  const std::size_t lanes = hn::Lanes(d);
  const auto weight = hn::Set(d, w);
  auto sum = hn::Zero(d);
  std::size_t i = 0;
  for (; i + lanes <= n; i += lanes) {
    const auto v = hn::LoadU(d, a + i);
    sum = hn::MulAdd(v, hn::LoadU(d, p + i), sum);
    hn::StoreU(hn::MulAdd(weight, v, hn::LoadU(d, y + i)), d, y + i);
  }
  float total = hn::GetLane(hn::SumOfLanes(d, sum));
  for (; i < n; ++i) {
    total += a[i] * p[i];
    y[i] += w * a[i];
  }
  return total;
}

// Sixteen patterns.

using BatchLanes = hn::CappedTag<float, kBatch>;

// A pixel's sixteen values are one vector (AVX-512) or several. The outer loop goes over these parts, so that
// the sums of the inner loop stay in registers. Four sums hide the latency of the multiply-add.
HWY_INLINE void dot_batch(const float* b, const float* p, std::size_t n, float* w) {
  const BatchLanes d;
  for (std::size_t part = 0; part < kBatch; part += hn::Lanes(d)) {
    const float* at = p + part;
    auto s0 = hn::Zero(d), s1 = s0, s2 = s0, s3 = s0;
    std::size_t j = 0;
    for (; j + 4 <= n; j += 4, at += 4 * kBatch) {
      s0 = hn::MulAdd(hn::Set(d, b[j]), hn::LoadU(d, at), s0);
      s1 = hn::MulAdd(hn::Set(d, b[j + 1]), hn::LoadU(d, at + kBatch), s1);
      s2 = hn::MulAdd(hn::Set(d, b[j + 2]), hn::LoadU(d, at + 2 * kBatch), s2);
      s3 = hn::MulAdd(hn::Set(d, b[j + 3]), hn::LoadU(d, at + 3 * kBatch), s3);
    }
    for (; j < n; ++j, at += kBatch) s0 = hn::MulAdd(hn::Set(d, b[j]), hn::LoadU(d, at), s0);
    hn::StoreU(hn::Add(hn::Add(s0, s1), hn::Add(s2, s3)), d, w + part);
  }
}

/// Lanes [part, part + lanes) of a pixel's mask.
HWY_INLINE hn::Mask<BatchLanes> lit_lanes(BatchLanes d, const LitMask* lit, std::size_t part) {
  const std::uint64_t bits = static_cast<std::uint64_t>(*lit) >> part;
  return hn::LoadMaskBits(d, reinterpret_cast<const std::uint8_t*>(&bits));
}

HWY_INLINE void dot_batch(const float* b, const LitMask* lit, std::size_t n, float* w) {
  const BatchLanes d;
  const auto lit_part = [&](std::size_t j, std::size_t part) {
    return hn::IfThenElseZero(lit_lanes(d, lit + j, part), hn::Set(d, b[j]));
  };
  for (std::size_t part = 0; part < kBatch; part += hn::Lanes(d)) {
    auto s0 = hn::Zero(d), s1 = s0, s2 = s0, s3 = s0;
    std::size_t j = 0;
    for (; j + 4 <= n; j += 4) {
      s0 = hn::Add(s0, lit_part(j, part));
      s1 = hn::Add(s1, lit_part(j + 1, part));
      s2 = hn::Add(s2, lit_part(j + 2, part));
      s3 = hn::Add(s3, lit_part(j + 3, part));
    }
    for (; j < n; ++j) s0 = hn::Add(s0, lit_part(j, part));
    hn::StoreU(hn::Add(hn::Add(s0, s1), hn::Add(s2, s3)), d, w + part);
  }
}

HWY_INLINE void add_scaled_batch(const float* a, const float* w, float* y, std::size_t n) {
  const BatchLanes d;
  for (std::size_t part = 0; part < kBatch; part += hn::Lanes(d)) {
    const auto weight = hn::LoadU(d, w + part);
    float* at = y + part;
    for (std::size_t i = 0; i < n; ++i, at += kBatch)
      hn::StoreU(hn::MulAdd(hn::Set(d, a[i]), weight, hn::LoadU(d, at)), d, at);
  }
}

void dot_batch_once(const float* b, const float* p, std::size_t n, float* w) {
  dot_batch(b, p, n, w);
}

void add_scaled_batch_once(const float* a, const float* w, float* y, std::size_t n) {
  add_scaled_batch(a, w, y, n);
}

/// P: floats kBatch a pixel, or masks one a pixel.
template <std::size_t kStride, class P>
HWY_INLINE void add_leaf(const LeafFactors& leaf, bool mirrored, const P* p, float* y) {
  HWY_ALIGN float forward[kBatch];
  HWY_ALIGN float backward[kBatch];
  const float* a = leaf.a;
  const float* b = leaf.b;
  const P* const p_col = p + kStride * leaf.col_begin;
  const P* const p_row = p + kStride * leaf.row_begin;
  for (std::size_t k = 0; k < leaf.rank; ++k, a += leaf.rows, b += leaf.cols) {
    dot_batch(b, p_col, leaf.cols, forward);
    if (mirrored) dot_batch(a, p_row, leaf.rows, backward);
    add_scaled_batch(a, forward, y + kBatch * leaf.row_begin, leaf.rows);
    if (mirrored) add_scaled_batch(b, backward, y + kBatch * leaf.col_begin, leaf.cols);
  }
}

void add_leaf_batch(const LeafFactors& leaf, bool mirrored, const float* p, float* y) {
  add_leaf<kBatch>(leaf, mirrored, p, y);
}

void add_lit_leaf_batch(const LeafFactors& leaf, bool mirrored, const LitMask* lit, float* y) {
  add_leaf<1>(leaf, mirrored, lit, y);
}
}  // namespace symrig::tensor::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::tensor {

HWY_EXPORT(dot);
HWY_EXPORT(add_scaled);
HWY_EXPORT(add_scaled_and_dot);

float dot(const float* a, const float* b, std::size_t n) {
  return HWY_DYNAMIC_DISPATCH(dot)(a, b, n);
}

void add_scaled(float w, const float* a, float* y, std::size_t n) {
  HWY_DYNAMIC_DISPATCH(add_scaled)(w, a, y, n);
}

float add_scaled_and_dot(float w, const float* a, const float* p, float* y, std::size_t n) {
  return HWY_DYNAMIC_DISPATCH(add_scaled_and_dot)(w, a, p, y, n);
}

HWY_EXPORT(dot_batch_once);
HWY_EXPORT(add_scaled_batch_once);
HWY_EXPORT(add_leaf_batch);
HWY_EXPORT(add_lit_leaf_batch);

void dot_batch(const float* b, const float* p, std::size_t n, float* w) {
  HWY_DYNAMIC_DISPATCH(dot_batch_once)(b, p, n, w);
}

void add_scaled_batch(const float* a, const float* w, float* y, std::size_t n) {
  HWY_DYNAMIC_DISPATCH(add_scaled_batch_once)(a, w, y, n);
}

void add_leaf_batch(const LeafFactors& leaf, bool mirrored, const float* p, float* y) {
  HWY_DYNAMIC_DISPATCH(add_leaf_batch)(leaf, mirrored, p, y);
}

void add_leaf_batch(const LeafFactors& leaf, bool mirrored, const LitMask* lit, float* y) {
  HWY_DYNAMIC_DISPATCH(add_lit_leaf_batch)(leaf, mirrored, lit, y);
}

}  // namespace symrig::tensor
#endif  // HWY_ONCE
