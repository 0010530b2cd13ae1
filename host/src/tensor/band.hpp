// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/tensor/transport_tensor.hpp"
#include "tensor/half.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::tensor {

/// A band leaf: one plane of halves for each offset, in raster order, without an index.
/// error: ≤ 2⁻¹¹ |value| + 2⁻³⁹ max|value of the plane|.
class Band {
 public:
  /// values: [channel][offset][raster pixel], offsets as band_offsets(radius) lists them.
  Band(Grid grid, int channels, int radius, std::span<const float> values);

  int radius() const { return radius_; }
  /// The given values, rounded.
  std::vector<float> values() const;
  /// y += T p on one row of the picture. Width patterns interleaved in p and y, raster order.
  template <std::size_t Width>
  void apply_row(int channel, int row, const float* p, float* y) const;
  std::int64_t bytes() const;

 private:
  std::size_t pixels() const { return static_cast<std::size_t>(grid_.size()); }

  Grid grid_;
  int radius_;
  std::vector<BandOffset> offsets_;
  std::vector<Half> halves_;   // [channel][offset][pixel], and slack for the kernels
  std::vector<float> scales_;  // [channel][offset]
};

}  // namespace symrig::tensor
