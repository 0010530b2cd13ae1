// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/kernels.hpp"

#include <array>
#include <cstddef>
#include <span>

namespace symrig::acquisition {

/// Samples of sixteen photographs and what each photograph weighs.
struct PhotographTerm {
  const float* samples;                      ///< [pixel][kBatch]
  std::array<float, tensor::kBatch> weight;  ///< [kBatch]
};

/// to[i] += Σ_terms Σ_c samples[i][c] weight[c] over n pixels: batches of photographs collapse into one
/// image. error: ≤ (terms × kBatch + 1) ε Σ|samples weight|; the same bits for any number of threads, not for
/// any instruction set.
void collapse(std::span<const PhotographTerm> terms, float* to, std::size_t n);

}  // namespace symrig::acquisition
