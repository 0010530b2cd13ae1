// SPDX-License-Identifier: Apache-2.0
#include "tensor/entries.hpp"
#include "tensor/panel_kernels.hpp"

#include <algorithm>

namespace symrig {

std::vector<BandOffset> band_offsets(int radius) {
  std::vector<BandOffset> offsets;
  for (int dx = 1; dx <= radius; ++dx) offsets.push_back({0, dx});
  for (int dy = 1; dy <= radius; ++dy)
    for (int dx = -radius; dx <= radius; ++dx) offsets.push_back({dy, dx});
  return offsets;
}

namespace tensor {
namespace {
constexpr int kTop = 14;  ///< the largest value of a plane as a half is in [2¹⁴, 2¹⁵)
}

Band::Band(Grid grid, int channels, int radius, std::span<const float> values)
    : grid_(grid), radius_(radius), offsets_(band_offsets(radius)), halves_(values.size() + Panels::kSlack) {
  for (std::size_t plane = 0; plane < static_cast<std::size_t>(channels) * offsets_.size(); ++plane)
    scales_.push_back(power_of_two(
        to_halves(values.subspan(plane * pixels(), pixels()), kTop, &halves_[plane * pixels()])));
}

std::vector<float> Band::values() const {
  std::vector<float> values(halves_.size() - Panels::kSlack);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = scales_[k / pixels()] * from_half(halves_[k]);
  return values;
}

// y[i] gets v_d[i] p[i + d] and, as the mirror image, v_d[i − d] p[i − d]: each row of y has one writer.
template <std::size_t Width>
void Band::apply_row(int channel, int row, const float* p, float* y) const {
  const auto at = [&](int r, int c) { return static_cast<std::size_t>(r) * grid_.cols + c; };
  for (std::size_t k = 0; k < offsets_.size(); ++k) {
    const auto [dy, dx] = offsets_[k];
    const std::size_t plane = static_cast<std::size_t>(channel) * offsets_.size() + k;
    const Half* const v = &halves_[plane * pixels()];
    const int wide = grid_.cols - std::abs(dx);
    if (wide <= 0) continue;
    const int left = std::max(0, -dx);  // first column of i that has i + d on the grid
    const int right = std::max(0, dx);  // first column of i that has i − d on the grid
    const std::size_t n = wide;
    if (row + dy < grid_.rows)
      add_products<Width>(v + at(row, left), scales_[plane], p + Width * at(row + dy, left + dx),
                          y + Width * at(row, left), n);
    if (row - dy >= 0)
      add_products<Width>(v + at(row - dy, right - dx), scales_[plane], p + Width * at(row - dy, right - dx),
                          y + Width * at(row, right), n);
  }
}

template void Band::apply_row<1>(int, int, const float*, float*) const;
template void Band::apply_row<kBatch>(int, int, const float*, float*) const;

std::int64_t Band::bytes() const {
  return static_cast<std::int64_t>(halves_.size() * sizeof(Half) + scales_.size() * sizeof(float));
}

}  // namespace tensor
}  // namespace symrig
