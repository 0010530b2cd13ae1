// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

namespace symrig {

/// The word SYMRIG in block letters, on one line or two, whichever is larger. Reports relight with this
/// picture [Garg06 Fig. 1 uses letters too].
/// shapes: [grid, 1 channel].
/// units: 0..1, the share of the pixel that the strokes cover. So any grid works; letters blur if a stroke is
/// thinner than a pixel.
Image<float> letters_pattern(Grid grid);

}  // namespace symrig
