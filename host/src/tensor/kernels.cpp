// SPDX-License-Identifier: Apache-2.0
// The three loops of applying a tensor. Compiled for every instruction set that Highway knows, and chosen at
// run time.
#include "tensor/kernels.hpp"

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

}  // namespace symrig::tensor
#endif  // HWY_ONCE
