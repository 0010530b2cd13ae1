// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"

#include <optional>
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

/// The part of an 8D tensor to relight: the view that shines and the view that sees [Garg06 Fig. 7].
struct ViewRelight {
  ViewLayout views;          ///< they tile both grids of the tensor
  std::optional<View> from;  ///< only this view's projector shines; all of them if empty
  std::optional<View> to;    ///< the result is only this view's picture; the whole photograph if empty
};

/// The grid of the light for relight(): that of the view `from`, or the projector's.
/// fails: bad_argument (views that do not tile the tensor's grids, or a view that is not one of them).
Result<Grid> light_grid(const TransportOperator& tensor, const ViewRelight& what);

/// The grid of the result: that of the view `to`, or the camera's.  fails: as light_grid.
Result<Grid> picture_grid(const TransportOperator& tensor, const ViewRelight& what);

/// photograph = T · light, with the light of one view only and the picture of one view only.
/// shapes: light_grid() (1 channel) → picture_grid() (channels()).
/// error: as TransportTensor::apply.  fails: as light_grid, size_mismatch.
Result<Image<float>> relight(const TransportOperator& tensor, const Image<float>& light,
                             const ViewRelight& what);

/// The same for many lights; reads T once for 16 of them.
/// error: as TransportTensor::apply_batch.  fails: as relight.
Result<std::vector<Image<float>>> relight_batch(const TransportOperator& tensor,
                                                std::span<const Image<float>> lights,
                                                const ViewRelight& what);

}  // namespace symrig
