// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::calibration {

/// The middle of the pixel that sees what lies `by` [cells] away from what the pixel (row, col) sees: in
/// pixels, where 0 is the middle of the first one. Newton's method on the corner map, which is nearly affine.
Point displaced_pixel(const CornerMap& corners, int row, int col, Point by);

/// The mean of the four pixels around a place, with bilinear weights, of those that are valid.
struct Mixed {
  float mean = 0, variance = 0;
  bool inside = false;  ///< one of the four is in the picture
  bool known = false;   ///< and valid
};
/// One channel of a photograph.
struct PhotographPlane {
  Grid grid;
  std::span<const float> mean, variance;
  std::span<const std::uint8_t> valid;

  Mixed at(float row, float col) const;
};
PhotographPlane plane_of(const Radiance& photograph, int channel);

/// Takes a second, displaced picture out of photographs of one camera (without_ghost). Thread-safe for
/// reading.
class GhostSubtraction {
 public:
  /// As without_ghost().
  static Result<GhostSubtraction> make(std::span<const CornerMap> corners, double share, Point place);

  Radiance operator()(const Radiance& photograph) const;
  /// For comparison: CRC-32C of all numbers.
  std::uint32_t digest() const;

 private:
  GhostSubtraction() = default;
  Image<float> light_without(const Radiance& photograph, int channel) const;

  double share_ = 0;
  std::vector<Image<float>> from_;  ///< of each map: row and column that the ghost of a pixel comes from
};

}  // namespace symrig::calibration
