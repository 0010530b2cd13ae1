// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

namespace symrig::acquisition {

/// Where each pixel of one picture is found in another: row shift (channel 0) and column shift (channel 1).
/// With the correlation there, 0 where none was found.
struct Shifts {
  Image<float> by;
  Image<float> correlation;
};

/// Dense block matching of `from` in `to`, coarse to fine. A pixel that is NaN is left out of all windows.
/// shapes: one channel each; sizes may differ by a pixel or so.
Shifts match(const Image<float>& from, const Image<float>& to);

/// Fills shifts where trust is low from where it is high, near before far, and leaves them where it is 1.
/// shapes: by [grid, any channels], trust [grid, 1], in [0, 1].
void fill_by_trust(Image<float>& by, const Image<float>& trust);

}  // namespace symrig::acquisition
