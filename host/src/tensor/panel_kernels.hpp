// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/half.hpp"
#include "tensor/kernels.hpp"
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

}  // namespace symrig::tensor
