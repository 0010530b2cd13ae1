// SPDX-License-Identifier: Apache-2.0
#include "relight_kernel.hpp"

namespace {

/// Four floats that may start at any float.
using Lanes = float __attribute__((vector_size(16), aligned(4), may_alias));
constexpr U32 kLanes = 4;
using Size = __SIZE_TYPE__;

const Lanes& lanes(const F32* at) {
  return *reinterpret_cast<const Lanes*>(at);
}
Lanes& lanes(F32* at) {  // NOLINT(readability-non-const-parameter): what it returns is written
  return *reinterpret_cast<Lanes*>(at);
}

/// 2^exponent, within the normal numbers.
F32 power_of_two(I32 exponent) {
  const I32 clipped = exponent < -126 ? -126 : exponent > 127 ? 127 : exponent;
  return __builtin_bit_cast(F32, static_cast<U32>(clipped + 127) << 23U);
}

/// A finite half. The exponent moves by the product, which also makes denormal halves right.
F32 from_half(U16 half) {
  const U32 size = (half & 0x7FFFU) << 13U;
  const F32 value = __builtin_bit_cast(F32, size) * 0x1p112F;
  return (half & 0x8000U) != 0 ? -value : value;
}

/// Σ a[i] b[i]. Two sums of four lanes hide the latency of the addition.
F32 dot(const F32* a, const F32* b, U32 n) {
  Lanes even = {0, 0, 0, 0}, odd = {0, 0, 0, 0};
  U32 i = 0;
  for (; i + 2 * kLanes <= n; i += 2 * kLanes) {
    even += lanes(a + i) * lanes(b + i);
    odd += lanes(a + i + kLanes) * lanes(b + i + kLanes);
  }
  even += odd;
  F32 sum = (even[0] + even[1]) + (even[2] + even[3]);
  for (; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

/// y += w a.
void add_scaled(F32 w, const F32* a, F32* y, U32 n) {
  const Lanes weight = {w, w, w, w};
  U32 i = 0;
  for (; i + kLanes <= n; i += kLanes) lanes(y + i) += weight * lanes(a + i);
  for (; i < n; ++i) y[i] += w * a[i];
}

/// One leaf: a [rows × rank] and b [cols × rank], and where its blocks begin.
struct LeafView {
  const F32* a;
  const F32* b;
  U32 row, rows, col, cols, rank;

  LeafView turned() const { return {b, a, col, cols, row, rows, rank}; }
};

/// y_I += A (Bᵀ p_J).
void add_leaf(const LeafView& leaf, const U32* lit, const F32* p, F32* y) {
  if (lit[leaf.col + leaf.cols] == lit[leaf.col]) return;
  for (Size k = 0; k < leaf.rank; ++k)
    add_scaled(dot(leaf.b + k * leaf.cols, p + leaf.col, leaf.cols), leaf.a + k * leaf.rows, y + leaf.row,
               leaf.rows);
}

constexpr U32 kLeafNumbers = 7;  // row_begin, row_end, col_begin, col_end, rank, level, mirrored

LeafView view_of(const I32* leaf, const F32* factors) {
  const U32 rows = leaf[1] - leaf[0], cols = leaf[3] - leaf[2], rank = leaf[4];
  return {factors, factors + Size{rows} * rank, static_cast<U32>(leaf[0]),
          rows,    static_cast<U32>(leaf[2]),   cols,
          rank};
}

}  // namespace

void symrig_widen(const U16* halves, F32* out, U32 count, I32 exponent) {
  const F32 scale = power_of_two(exponent);
  for (U32 k = 0; k < count; ++k) out[k] = scale * from_half(halves[k]);
}

void symrig_widen_leaves(const I32* leaves, U32 count, U32 channels, const U16* halves,
                         const signed char* exponents, F32* out) {
  for (U32 l = 0; l < count; ++l, leaves += kLeafNumbers)
    for (U32 side = 0; side < 2 * channels; ++side) {
      const U32 pixels = side % 2 == 0 ? leaves[1] - leaves[0] : leaves[3] - leaves[2];
      for (I32 k = 0; k < leaves[4]; ++k, halves += pixels, out += pixels, ++exponents)
        symrig_widen(halves, out, pixels, *exponents);
    }
}

void symrig_add_leaves(const I32* leaves, U32 count, U32 channels, U32 channel, const F32* factors,
                       U32 transposed, const U32* lit, const F32* p, F32* y) {
  for (U32 l = 0; l < count; ++l, leaves += kLeafNumbers) {
    const Size values =
        static_cast<Size>(leaves[1] - leaves[0] + leaves[3] - leaves[2]) * static_cast<U32>(leaves[4]);
    const LeafView leaf = view_of(leaves, factors + channel * values);
    if (transposed == 0 || leaves[6] != 0) add_leaf(leaf, lit, p, y);
    if (transposed != 0 || leaves[6] != 0) add_leaf(leaf.turned(), lit, p, y);
    factors += channels * values;
  }
}

void symrig_count_lit(const F32* p, U32 count, U32* lit) {
  lit[0] = 0;
  for (U32 k = 0; k < count; ++k) lit[k + 1] = lit[k] + (p[k] != 0.0F ? 1U : 0U);
}

void symrig_add_products(const F32* d, const F32* p, F32* y, U32 count) {
  for (U32 k = 0; k < count; ++k) y[k] += d[k] * p[k];
}

void symrig_add_entries(const U32* starts, U32 rows, const U32* cols, const F32* values, U32 mode,
                        const F32* p, F32* y) {
  for (U32 r = 0; r < rows; ++r) {
    F32 seen = 0;
    for (U32 k = starts[r]; k < starts[r + 1]; ++k) {
      seen += values[k] * p[cols[k]];
      if (mode != 0) y[cols[k]] += values[k] * p[r];
    }
    if (mode != 1) y[r] += seen;
  }
}

void symrig_add_band(const F32* v, I32 dy, I32 dx, I32 rows, I32 cols, const F32* p, F32* y) {
  const I32 left = dx < 0 ? -dx : 0, right = dx > 0 ? cols - dx : cols;
  for (I32 row = 0; row + dy < rows; ++row)
    for (I32 col = left; col < right; ++col) {
      const I32 i = row * cols + col, j = i + dy * cols + dx;
      y[i] += v[i] * p[j];
      y[j] += v[i] * p[i];
    }
}

void symrig_add_columns(const I32* columns, U32 count, const I32* rows, const F32* values, U32 transposed,
                        const F32* p, F32* y) {
  for (U32 c = 0; c < count; ++c, columns += 4) {
    const I32 begin = columns[0], end = columns[1];
    F32 sum = 0;
    if (transposed == 0)
      for (I32 j = begin; j < end; ++j) sum += p[j];
    for (I32 k = columns[2]; k < columns[3]; ++k) {
      if (transposed == 0)
        y[rows[k]] += values[k] * sum;
      else
        sum += values[k] * p[rows[k]];
    }
    if (transposed != 0)
      for (I32 j = begin; j < end; ++j) y[j] += sum;
  }
}
