// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/internal/half.hpp"
#include "symrig/tensor/internal/kernels.hpp"
#include "tensor/panels.hpp"

#include <cstddef>
#include <span>

namespace symrig::tensor {

/// The factors of one chunk: its panels and their stream of values.
struct PanelStream {
  std::span<const Panel> panels;
  const Half* values;  ///< the whole stream of a channel, with Panels::kSlack values of padding
  std::size_t first;   ///< index of the chunk's first value
};

/// dots[piece] = Σ_i W[i, piece] p[i] over the pixels of a piece. Width patterns interleaved, 1 or kBatch:
/// p [pixels × Width], dots [pieces × Width].
/// error: ≤ n ε Σ|W p| for a piece of n pixels; the same bits for any number of threads.
template <std::size_t Width>
void panel_dots(const PanelStream& stream, const float* p, float* dots);

/// y[i] += Σ_piece W[i, piece] weights[piece].
template <std::size_t Width>
void panel_add(const PanelStream& stream, const float* weights, float* y);

/// out = n halves as floats. Reads up to Panels::kSlack halves after the last one.
void to_floats(const Half* halves, std::size_t n, float* out);

/// y[i] += scale v[i] p[i]: a row of a band. Width patterns interleaved in p and y, 1 or kBatch.
template <std::size_t Width>
void add_products(const Half* v, float scale, const float* p, float* y, std::size_t n);

}  // namespace symrig::tensor
