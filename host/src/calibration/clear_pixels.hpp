// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <cstddef>
#include <optional>
#include <vector>

namespace symrig::calibration {

/// Pixels that change clearly from photograph to photograph, whatever their order is. Nothing of the sequence
/// is assumed, so they also serve a sequence that contradicts itself.
struct ClearPixels {
  std::vector<std::size_t> at;  ///< at most 8,000, away from the last rows and columns
  double contrast = 0;          ///< rms of their range over the photographs

  static constexpr int kNext = 2;  ///< pixels to the right and below that exist
};

/// A pixel's range is that of its values without the largest and the smallest one. Clear: at least a quarter
/// of the range that one pixel in twenty exceeds.
/// held_out: a pair that is not used.
ClearPixels find_clear_pixels(const CodePhotographs& photographs, const std::optional<int>& held_out = {});

}  // namespace symrig::calibration
