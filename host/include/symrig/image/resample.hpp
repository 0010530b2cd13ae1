// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

namespace symrig {

/// Picture of another size; each new pixel is the old pixel under its centre. Empty if either grid is.
Image<float> resize_nearest(const Image<float>& image, Grid grid);

/// Picture of another size; each new pixel is the mean of the old ones under it, by area. The mean of the
/// picture is kept. Empty if either grid is.
Image<float> resize_box(const Image<float>& image, Grid grid);

/// One channel. RGB is weighed as linear luminance: 0.2126 R + 0.7152 G + 0.0722 B (Rec. 709); any other
/// number of channels is averaged.
Image<float> to_gray(const Image<float>& image);

}  // namespace symrig
