// SPDX-License-Identifier: Apache-2.0
// Kernels on rows of halves: conversion to floats, and a band's plane times the light.
#include "tensor/row_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tensor/row_kernels.cpp"
#include "tensor/disabled_targets.hpp"

// Highway needs this order of includes.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "tensor/half_lanes-inl.hpp"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace symrig::tensor::HWY_NAMESPACE {

void halves_to_floats(const Half* halves, std::size_t n, float* out) {
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) hn::StoreU(load_halves(halves + i), D(), out + i);
  if (i < n) store_part(load_halves(halves + i), out + i, n - i);
}

void products_single(const Half* v, float scale, const float* p, float* y, std::size_t n) {
  const D d;
  const V factor = hn::Set(d, scale);
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes)
    hn::StoreU(hn::MulAdd(hn::Mul(load_halves(v + i), factor), hn::LoadU(d, p + i), hn::LoadU(d, y + i)), d,
               y + i);
  if (i == n) return;
  const V sum =
      hn::MulAdd(hn::Mul(load_halves(v + i), factor), load_part(p + i, n - i), load_part(y + i, n - i));
  store_part(sum, y + i, n - i);
}

void products_batched(const Half* v, float scale, const float* p, float* y, std::size_t n) {
  const D d;
  HWY_ALIGN float values[kTile];
  for (std::size_t first = 0; first < n; first += kTile, v += kTile) {
    for (std::size_t i = 0; i < kTile; i += kLanes)
      hn::Store(hn::Mul(load_halves(v + i), hn::Set(d, scale)), d, values + i);
    for (std::size_t i = 0; i < HWY_MIN(kTile, n - first); ++i) {
      for (std::size_t part = 0; part < kBatch; part += kLanes, p += kLanes, y += kLanes)
        hn::StoreU(hn::MulAdd(hn::Set(d, values[i]), hn::LoadU(d, p), hn::LoadU(d, y)), d, y);
    }
  }
}

}  // namespace symrig::tensor::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace symrig::tensor {

HWY_EXPORT(halves_to_floats);
HWY_EXPORT(products_single);
HWY_EXPORT(products_batched);

void to_floats(const Half* halves, std::size_t n, float* out) {
  HWY_DYNAMIC_DISPATCH(halves_to_floats)(halves, n, out);
}
template <>
void add_products<1>(const Half* v, float scale, const float* p, float* y, std::size_t n) {
  HWY_DYNAMIC_DISPATCH(products_single)(v, scale, p, y, n);
}
template <>
void add_products<kBatch>(const Half* v, float scale, const float* p, float* y, std::size_t n) {
  HWY_DYNAMIC_DISPATCH(products_batched)(v, scale, p, y, n);
}

}  // namespace symrig::tensor
#endif  // HWY_ONCE
