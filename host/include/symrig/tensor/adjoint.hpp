// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/transport_tensor.hpp"

namespace symrig {

/// light = Σ_c T_cᵀ y_c, so that ⟨T x, y⟩ = ⟨x, Tᵀ y⟩ over all channels.  shapes: camera grid (the tensor's
/// channels) → projector grid (1 channel).  error: as TransportTensor::apply.  fails: size_mismatch.
Result<Image<float>> apply_adjoint(const TransportTensor& tensor, const Image<float>& picture);

}  // namespace symrig
