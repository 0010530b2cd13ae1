// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/view_layout.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <optional>
#include <span>
#include <vector>

namespace symrig {

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
