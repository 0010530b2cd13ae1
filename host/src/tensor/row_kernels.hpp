// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/half.hpp"
#include "tensor/kernels.hpp"
#include "tensor/panels.hpp"

#include <cstddef>

namespace symrig::tensor {

/// out = n halves as floats. Reads up to Panels::kSlack halves after the last one.
void to_floats(const Half* halves, std::size_t n, float* out);

/// y[i] += scale v[i] p[i]: a row of a band. Width patterns interleaved in p and y, 1 or kBatch.
template <std::size_t Width>
void add_products(const Half* v, float scale, const float* p, float* y, std::size_t n);

}  // namespace symrig::tensor
