// SPDX-License-Identifier: Apache-2.0
// The loops of applying a tensor. Compiled for every instruction set that Highway knows, and chosen at run
// time. Halves are converted to floats in registers; sums are floats.
#include "tensor/panel_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tensor/panel_kernels.cpp"
// The sums are arrays of vectors, which targets without a fixed vector length do not allow. Machines with
// such targets also have others (NEON). On x86-64 the kernels exist for SSE2, AVX2 and AVX-512: processors
// between the first two use SSE2, and the longest kernels compile in less time.
#define HWY_DISABLED_TARGETS \
  (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3 | HWY_SSE4)

// Highway needs this order of includes.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

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

// Rows of halves: conversion to floats, and a band's plane times the light.

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

// Panels.

#if HWY_TARGET == HWY_SCALAR
/// out[k] += the sum of the lanes of acc[k], for vectors of one lane.
template <std::size_t K>
void add_sums(const V* acc, float* out) {
  for (std::size_t k = 0; k < K; ++k) out[k] += hn::GetLane(acc[k]);
}
#else
/// Sums over 128-bit blocks, each block one sum for each of a, b, c, e.
HWY_INLINE V block_sums(V a, V b, V c, V e) {
  const D d;
  const hn::RepartitionToWide<D> wide;
  const V ab = hn::Add(hn::InterleaveLower(d, a, b), hn::InterleaveUpper(d, a, b));
  const V ce = hn::Add(hn::InterleaveLower(d, c, e), hn::InterleaveUpper(d, c, e));
  const auto left = hn::BitCast(wide, ab);
  const auto right = hn::BitCast(wide, ce);
  return hn::Add(hn::BitCast(d, hn::InterleaveLower(wide, left, right)),
                 hn::BitCast(d, hn::InterleaveUpper(wide, left, right)));
}

/// Adds the blocks of a vector: four lanes remain.
template <class Tag, class Vector>
HWY_INLINE hn::Vec128<float> fold(Tag d, Vector v) {
  if constexpr (hn::MaxLanes(Tag()) > 4) {
    const hn::Half<Tag> half;
    return fold(half, hn::Add(hn::LowerHalf(half, v), hn::UpperHalf(half, v)));
  } else {
    (void)d;
    return v;
  }
}

/// out[k] += the sum of the lanes of acc[k].
template <std::size_t K>
HWY_INLINE void add_sums(const V* acc, float* out) {
  const V zero = hn::Zero(D());
  HWY_ALIGN float sums[4];
#pragma GCC unroll 8
  for (std::size_t k = 0; k < K; k += 4) {
    const V s = block_sums(acc[k], k + 1 < K ? acc[k + 1] : zero, k + 2 < K ? acc[k + 2] : zero,
                           k + 3 < K ? acc[k + 3] : zero);
    hn::Store(fold(D(), s), hn::FixedTag<float, 4>(), sums);
    for (std::size_t i = 0; i < 4 && k + i < K; ++i) out[k + i] += sums[i];
  }
}
#endif

/// One pattern: the vector lanes are neighbouring values of a line.
struct Single {
  static constexpr std::size_t kWidth = 1;

  /// out[k] += Σ_x w[k][x] v[x] for the K lines of a group.
  template <std::size_t K>
  static HWY_INLINE void dot(const Half* w, std::size_t n, const float* v, float* out) {
    const D d;
    V acc[K];
#pragma GCC unroll 8
    for (std::size_t k = 0; k < K; ++k) acc[k] = hn::Zero(d);
    std::size_t x = 0;
    for (; x + kTile <= n; x += kTile, w += K * kTile) {
#pragma GCC unroll 4
      for (std::size_t part = 0; part < kTile; part += kLanes) {
        const V values = hn::LoadU(d, v + x + part);
#pragma GCC unroll 8
        for (std::size_t k = 0; k < K; ++k)
          acc[k] = hn::MulAdd(load_halves(w + k * kTile + part), values, acc[k]);
      }
    }
    const std::size_t left = n - x;
    for (std::size_t part = 0; part < left; part += kLanes) {
      const auto mask = hn::FirstN(d, left - part);
      const V values = load_part(v + x + part, left - part);
#pragma GCC unroll 8
      for (std::size_t k = 0; k < K; ++k)
        acc[k] = hn::MulAdd(hn::IfThenElseZero(mask, load_halves(w + k * left + part)), values, acc[k]);
    }
    add_sums<K>(acc, out);
  }

  /// y[x] += Σ_k s[k] w[k][x].
  template <std::size_t K>
  static HWY_INLINE void add(const Half* w, std::size_t n, const float* s, float* y) {
    const D d;
    V scale[K];
#pragma GCC unroll 8
    for (std::size_t k = 0; k < K; ++k) scale[k] = hn::Set(d, s[k]);
    std::size_t x = 0;
    for (; x + kTile <= n; x += kTile, w += K * kTile) {
#pragma GCC unroll 4
      for (std::size_t part = 0; part < kTile; part += kLanes) {
        V sum = hn::LoadU(d, y + x + part);
#pragma GCC unroll 8
        for (std::size_t k = 0; k < K; ++k)
          sum = hn::MulAdd(load_halves(w + k * kTile + part), scale[k], sum);
        hn::StoreU(sum, d, y + x + part);
      }
    }
    const std::size_t left = n - x;
    for (std::size_t part = 0; part < left; part += kLanes) {
      V sum = load_part(y + x + part, left - part);
#pragma GCC unroll 8
      for (std::size_t k = 0; k < K; ++k) sum = hn::MulAdd(load_halves(w + k * left + part), scale[k], sum);
      store_part(sum, y + x + part, left - part);
    }
  }
};

/// kBatch patterns: the vector lanes are the patterns, and each factor value is broadcast to them.
struct Batched {
  static constexpr std::size_t kWidth = kBatch;

  /// The floats of one tile of K lines, and the width of its lines.
  template <std::size_t K>
  struct Tile {
    HWY_ALIGN float values[K * kTile + kLanes];
    HWY_INLINE void load(const Half* w, std::size_t wide) {
      for (std::size_t i = 0; i < K * wide; i += kLanes) hn::StoreU(load_halves(w + i), D(), values + i);
    }
  };

  template <std::size_t K>
  static HWY_INLINE void dot(const Half* w, std::size_t n, const float* v, float* out) {
    const D d;
    Tile<K> tile;
    for (std::size_t part = 0; part < kBatch; part += kLanes) {
      V acc[K];
#pragma GCC unroll 8
      for (std::size_t k = 0; k < K; ++k) acc[k] = hn::LoadU(d, out + k * kBatch + part);
      const Half* at = w;
      for (std::size_t x = 0; x < n; x += kTile) {
        const std::size_t wide = HWY_MIN(kTile, n - x);
        tile.load(at, wide);
        at += K * wide;
        for (std::size_t i = 0; i < wide; ++i) {
          const V values = hn::LoadU(d, v + (x + i) * kBatch + part);
#pragma GCC unroll 8
          for (std::size_t k = 0; k < K;
               ++k)  // NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): load() set it
            acc[k] = hn::MulAdd(hn::Set(d, tile.values[k * wide + i]), values, acc[k]);
        }
      }
#pragma GCC unroll 8
      for (std::size_t k = 0; k < K; ++k) hn::StoreU(acc[k], d, out + k * kBatch + part);
    }
  }

  template <std::size_t K>
  static HWY_INLINE void add(const Half* w, std::size_t n, const float* s, float* y) {
    const D d;
    Tile<K> tile;
    for (std::size_t part = 0; part < kBatch; part += kLanes) {
      V scale[K];
#pragma GCC unroll 8
      for (std::size_t k = 0; k < K; ++k) scale[k] = hn::LoadU(d, s + k * kBatch + part);
      const Half* at = w;
      for (std::size_t x = 0; x < n; x += kTile) {
        const std::size_t wide = HWY_MIN(kTile, n - x);
        tile.load(at, wide);
        at += K * wide;
        for (std::size_t i = 0; i < wide; ++i) {
          float* const to = y + (x + i) * kBatch + part;
          V sum = hn::LoadU(d, to);
#pragma GCC unroll 8
          for (std::size_t k = 0; k < K; ++k)
            sum = hn::MulAdd(hn::Set(d, tile.values[k * wide + i]), scale[k], sum);
          hn::StoreU(sum, d, to);
        }
      }
    }
  }
};

/// Calls use(lines) with the number of lines of a group, 1..kGroup, as a compile-time constant.
template <class Use>
HWY_INLINE void with_lines(std::size_t lines, const Use& use) {
  switch (lines) {
    case 8:
      return use(std::integral_constant<std::size_t, 8>());
    case 7:
      return use(std::integral_constant<std::size_t, 7>());
    case 6:
      return use(std::integral_constant<std::size_t, 6>());
    case 5:
      return use(std::integral_constant<std::size_t, 5>());
    case 4:
      return use(std::integral_constant<std::size_t, 4>());
    case 3:
      return use(std::integral_constant<std::size_t, 3>());
    case 2:
      return use(std::integral_constant<std::size_t, 2>());
    default:
      return use(std::integral_constant<std::size_t, 1>());
  }
}

/// out[k] += Σ_x W[k, x] v[x] over all lines of a panel.
template <class Kernel>
HWY_INLINE void dot_lines(const Half* w, std::size_t length, std::size_t count, const float* v, float* out) {
  for (std::size_t k = 0; k < count; k += kGroup)
    with_lines(HWY_MIN(kGroup, count - k), [&](auto lines) HWY_ATTR {
      Kernel::template dot<lines()>(w + k * length, length, v, out + k * Kernel::kWidth);
    });
}

HWY_INLINE bool any(const float* values, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i)
    if (values[i] != 0.0F) return true;
  return false;
}

/// y[x] += Σ_k W[k, x] s[k]. Groups of lines that are all dark are not read.
template <class Kernel>
HWY_INLINE void add_lines(const Half* w, std::size_t length, std::size_t count, const float* s, float* y) {
  for (std::size_t k = 0; k < count; k += kGroup) {
    const std::size_t group = HWY_MIN(kGroup, count - k);
    const float* const weights = s + k * Kernel::kWidth;
    if (!any(weights, group * Kernel::kWidth)) continue;
    with_lines(group, [&](auto lines)
                          HWY_ATTR { Kernel::template add<lines()>(w + k * length, length, weights, y); });
  }
}

template <class Kernel>
HWY_INLINE void dots(const PanelStream& stream, const float* p, float* out) {
  std::size_t start = stream.first;
  for (const Panel& panel : stream.panels) {
    const std::size_t length = panel.length(), count = panel.count();
    start = panel_start(start, length);
    const float* const from = p + static_cast<std::size_t>(panel.begin) * Kernel::kWidth;
    const std::size_t columns = static_cast<std::size_t>(panel.columns) * Kernel::kWidth;
    for (std::size_t k = 0; k < columns; ++k) out[k] = 0;
    if (panel.along_pixels()) {
      dot_lines<Kernel>(stream.values + start, length, count, from, out);
    } else {
      add_lines<Kernel>(stream.values + start, length, count, from, out);
    }
    out += columns;
    start += panel.values();
  }
}

template <class Kernel>
HWY_INLINE void add(const PanelStream& stream, const float* weights, float* y) {
  std::size_t start = stream.first;
  for (const Panel& panel : stream.panels) {
    const std::size_t length = panel.length(), count = panel.count();
    start = panel_start(start, length);
    float* const to = y + static_cast<std::size_t>(panel.begin) * Kernel::kWidth;
    if (panel.along_pixels()) {
      add_lines<Kernel>(stream.values + start, length, count, weights, to);
    } else {
      dot_lines<Kernel>(stream.values + start, length, count, weights, to);
    }
    weights += static_cast<std::size_t>(panel.columns) * Kernel::kWidth;
    start += panel.values();
  }
}

void dots_single(const PanelStream& stream, const float* p, float* out) {
  dots<Single>(stream, p, out);
}
void dots_batched(const PanelStream& stream, const float* p, float* out) {
  dots<Batched>(stream, p, out);
}
void add_single(const PanelStream& stream, const float* s, float* y) {
  add<Single>(stream, s, y);
}
void add_batched(const PanelStream& stream, const float* s, float* y) {
  add<Batched>(stream, s, y);
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

HWY_EXPORT(dots_single);
HWY_EXPORT(dots_batched);
HWY_EXPORT(add_single);
HWY_EXPORT(add_batched);

template <>
void panel_dots<1>(const PanelStream& stream, const float* p, float* dots) {
  HWY_DYNAMIC_DISPATCH(dots_single)(stream, p, dots);
}
template <>
void panel_dots<kBatch>(const PanelStream& stream, const float* p, float* dots) {
  HWY_DYNAMIC_DISPATCH(dots_batched)(stream, p, dots);
}
template <>
void panel_add<1>(const PanelStream& stream, const float* weights, float* y) {
  HWY_DYNAMIC_DISPATCH(add_single)(stream, weights, y);
}
template <>
void panel_add<kBatch>(const PanelStream& stream, const float* weights, float* y) {
  HWY_DYNAMIC_DISPATCH(add_batched)(stream, weights, y);
}
}  // namespace symrig::tensor
#endif  // HWY_ONCE
