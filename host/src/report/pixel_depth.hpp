// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/transport_tensor.hpp"

namespace symrig::report {

/// How finely the transport of each pixel is divided, on the camera's grid.
struct PixelDepth {
  /// Mean level of the leaves (including empty ones) in the pixel's row of T, over their entries.
  Image<float> level;
  /// Number of terms of the pixel's row of T: products of two pictures, single entries, entries of bands.
  Image<float> terms;
};

/// needs: a symmetric tensor.
PixelDepth pixel_depth(const TransportTensor& tensor);

}  // namespace symrig::report
