// SPDX-License-Identifier: Apache-2.0
// Vectors of floats from halves, and parts of vectors; included once for each instruction set (Highway).
#if defined(SYMRIG_TENSOR_HALF_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef SYMRIG_TENSOR_HALF_LANES_INL
#undef SYMRIG_TENSOR_HALF_LANES_INL
#else
#define SYMRIG_TENSOR_HALF_LANES_INL
#endif

#include "tensor/half.hpp"
#include "tensor/kernels.hpp"
#include "tensor/panels.hpp"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace symrig::tensor::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, kTile>;
using V = hn::Vec<D>;
constexpr std::size_t kLanes = hn::MaxLanes(D());
static_assert(kTile % kLanes == 0 && kBatch % kLanes == 0);

HWY_INLINE V load_halves(const Half* from) {
  const hn::Rebind<hwy::float16_t, D> d16;
  return hn::PromoteTo(D(), hn::LoadU(d16, reinterpret_cast<const hwy::float16_t*>(from)));
}

/// Loads the first n values and fills with zeros. Does not read past them: those may belong to another
/// thread.
HWY_INLINE V load_part(const float* from, std::size_t n) {
  const D d;
#if HWY_TARGET <= HWY_AVX2
  return hn::MaskedLoad(hn::FirstN(d, n), d, from);
#else
  HWY_ALIGN float values[kLanes] = {};
  for (std::size_t i = 0; i < HWY_MIN(n, kLanes); ++i) values[i] = from[i];
  return hn::Load(d, values);
#endif
}

/// Stores only the first n values.
HWY_INLINE void store_part(V v, float* to, std::size_t n) {
  const D d;
#if HWY_TARGET <= HWY_AVX2
  hn::BlendedStore(v, hn::FirstN(d, n), d, to);
#else
  HWY_ALIGN float values[kLanes];
  hn::Store(v, d, values);
  for (std::size_t i = 0; i < HWY_MIN(n, kLanes); ++i) to[i] = values[i];
#endif
}

}  // namespace symrig::tensor::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // SYMRIG_TENSOR_HALF_LANES_INL
