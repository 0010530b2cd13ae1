// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <span>
#include <vector>

namespace symrig {

/// photograph = T · pattern, wherever the parts of T are: in this process (TransportTensor), or dealt over
/// several. Jobs that only apply T take this.
class TransportOperator {
 public:
  virtual ~TransportOperator() = default;

  virtual Grid camera_grid() const = 0;
  virtual Grid projector_grid() const = 0;
  virtual int channels() const = 0;

  /// shapes: projector grid (1 channel) → camera grid (channels()). units: pattern 0..1 → radiance per unit
  /// of projector light. error: TransportTensor::apply states it. fails: size_mismatch.
  virtual Result<Image<float>> apply(const Image<float>& pattern) const = 0;
  /// Photographs of many patterns; reads T once for 16 of them. Same error and failures as apply. The order
  /// of the sums differs, so the last bits may differ.
  virtual Result<std::vector<Image<float>>> apply_batch(std::span<const Image<float>> patterns) const = 0;
  /// light = Σ_c T_cᵀ y_c, so that ⟨T x, y⟩ = ⟨x, Tᵀ y⟩ over all channels. shapes: camera grid (channels())
  /// → projector grid (1 channel). Same error and failures as apply.
  virtual Result<Image<float>> adjoint(const Image<float>& picture) const = 0;

 protected:
  TransportOperator() = default;
  TransportOperator(const TransportOperator&) = default;
  TransportOperator& operator=(const TransportOperator&) = default;
  TransportOperator(TransportOperator&&) = default;
  TransportOperator& operator=(TransportOperator&&) = default;
};

}  // namespace symrig
