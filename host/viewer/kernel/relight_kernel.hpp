// SPDX-License-Identifier: Apache-2.0
// The kernel of the exported page: photograph = T · pattern, for one channel, on one thread. It uses no
// library, so the same source becomes WebAssembly for the page and machine code for the tests. All sums have
// 32 bits, as those of the library.
#pragma once

using F32 = float;
using I32 = int;
using U16 = unsigned short;
using U32 = unsigned int;

#ifdef __wasm__
#define SYMRIG_KERNEL(name) __attribute__((export_name(#name)))
#else
#define SYMRIG_KERNEL(name)
#endif

extern "C" {

/// out[k] = halves[k] · 2^exponent. halves: bits of IEEE 754 binary16, finite.
SYMRIG_KERNEL(widen) void symrig_widen(const U16* halves, F32* out, U32 count, I32 exponent);

/// Widens the factors of all leaves. leaves: 7 numbers for each, see symrig_add_leaves. halves: leaf after
/// leaf, for each channel A [rows × rank], then B [cols × rank], column by column. exponents: one for each
/// column, in the same order. out: as halves.
SYMRIG_KERNEL(widen_leaves)
void symrig_widen_leaves(const I32* leaves, U32 count, U32 channels, const U16* halves,
                         const signed char* exponents, F32* out);

/// y += A (Bᵀ p) for all leaves of one channel; Tᵀ if transposed. p, y: tree order. They must not overlap.
/// leaves: row_begin, row_end, col_begin, col_end, rank, level, mirrored for each. A mirrored leaf also adds
/// B (Aᵀ p). lit: the number of non-zero values of p before each pixel, one more than p has. A leaf without
/// light is skipped.
SYMRIG_KERNEL(add_leaves)
void symrig_add_leaves(const I32* leaves, U32 count, U32 channels, U32 channel, const F32* factors,
                       U32 transposed, const U32* lit, const F32* p, F32* y);

/// lit[k] = the number of non-zero values before p[k], k ≤ count.
SYMRIG_KERNEL(count_lit) void symrig_count_lit(const F32* p, U32 count, U32* lit);

/// y[i] += d[i] p[i].
SYMRIG_KERNEL(add_products) void symrig_add_products(const F32* d, const F32* p, F32* y, U32 count);

/// Entries of T, row after row: row r has the entries starts[r] .. starts[r + 1]. mode 0: y[r] += v p[c];
/// 1: transposed; 2: both, for the entries of a symmetric tensor.
SYMRIG_KERNEL(add_entries)
void symrig_add_entries(const U32* starts, U32 rows, const U32* cols, const F32* values, U32 mode,
                        const F32* p, F32* y);

/// One plane of a band, raster order: y[i] += v[i] p[i + d] and y[i + d] += v[i] p[i], for d = (dy, dx) on a
/// grid.
SYMRIG_KERNEL(add_band)
void symrig_add_band(const F32* v, I32 dy, I32 dx, I32 rows, I32 cols, const F32* p, F32* y);

/// Measured columns: y[rows[k]] += values[k] Σ p[begin, end), and Tᵀ if transposed. columns: begin, end,
/// first, last for each.
SYMRIG_KERNEL(add_columns)
void symrig_add_columns(const I32* columns, U32 count, const I32* rows, const F32* values, U32 transposed,
                        const F32* p, F32* y);
}
