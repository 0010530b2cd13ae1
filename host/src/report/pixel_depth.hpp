// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/transport_tensor.hpp"

namespace symrig::report {

/// How finely the transport of each pixel is cut, on the camera's grid.
struct PixelDepth {
  /// Mean level of the leaves (empty ones too) in the pixel's row of T, over the entries that they hold.
  Image<float> level;
  /// Numbers that make its row of T: products of two pictures, single entries, entries of bands.
  Image<float> terms;
};

/// Of a symmetric tensor.
PixelDepth pixel_depth(const TransportTensor& tensor);

}  // namespace symrig::report
