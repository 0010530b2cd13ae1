// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

namespace symrig {

/// Scales a picture; each new pixel is the old pixel under its centre. Empty if either grid is empty.
Image<float> resize_nearest(const Image<float>& image, Grid grid);

/// Scales a picture; each new pixel is the mean of the old pixels under it, weighted by area. This keeps the
/// mean of the picture. Empty if either grid is empty.
Image<float> resize_box(const Image<float>& image, Grid grid);

/// Converts to one channel. RGB becomes linear luminance: 0.2126 R + 0.7152 G + 0.0722 B (Rec. 709). Any
/// other number of channels is averaged.
Image<float> to_gray(const Image<float>& image);

}  // namespace symrig
