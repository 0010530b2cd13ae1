// SPDX-License-Identifier: Apache-2.0
// Slices of T [Garg06 Fig. 2c] and the level of the leaf behind each entry [Garg06 Fig. 2d].
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

namespace symrig {
namespace {

using RowPixels = std::vector<std::pair<std::int32_t, int>>;  // (tree index, picture column), sorted

std::span<const std::pair<std::int32_t, int>> in_range(const RowPixels& pixels, std::int32_t begin,
                                                       std::int32_t end) {
  const auto at = [&](std::int32_t i) {
    return std::lower_bound(pixels.begin(), pixels.end(), std::pair{i, 0}) - pixels.begin();
  };
  return std::span(pixels).subspan(at(begin), static_cast<std::size_t>(at(end) - at(begin)));
}

/// Calls paint(i, j, x, u) for each entry (i, j) of the block pair whose pixels are in the picture row, in
/// columns x and u.
template <class Paint>
void for_entries(const RowPixels& pixels, std::int32_t row_begin, std::int32_t row_end,
                 std::int32_t col_begin, std::int32_t col_end, const Paint& paint) {
  for (const auto& [i, x] : in_range(pixels, row_begin, row_end))
    for (const auto& [j, u] : in_range(pixels, col_begin, col_end)) paint(i, j, x, u);
}

void paint_band(const BandLeaf& band, int level, Image<float>& out) {
  for (int x = 0; x < out.grid().cols; ++x)
    for (int u = x + 1; u < std::min(out.grid().cols, x + band.radius + 1); ++u)
      out.at(x, u) = out.at(u, x) = static_cast<float>(level);
}

/// Adds a band's entries between pixels of one picture row: those with dy = 0, the first `radius` offsets.
void add_band_row(const BandLeaf& band, Grid grid, int row, int channel, Image<float>& out) {
  const std::size_t planes = band_offsets(band.radius).size();
  for (int dx = 1; dx <= band.radius; ++dx) {
    const std::size_t plane = static_cast<std::size_t>(channel) * planes + static_cast<std::size_t>(dx) - 1;
    const std::size_t at =
        plane * static_cast<std::size_t>(grid.size()) + static_cast<std::size_t>(row) * grid.cols;
    for (int x = 0; x + dx < grid.cols; ++x) {
      out.at(x, x + dx) += band.values[at + static_cast<std::size_t>(x)];
      out.at(x + dx, x) += band.values[at + static_cast<std::size_t>(x)];
    }
  }
}

}  // namespace

Result<std::vector<std::pair<std::int32_t, int>>> TransportTensor::row_pixels(int camera_row) const {
  const Grid grid = camera_.grid();
  if (!symmetric_)
    return Error{ErrorCode::bad_argument, "a slice needs a symmetric tensor",
                 "the two halves of this tensor differ, or only one is measured"};
  if (camera_row < 0 || camera_row >= grid.rows)
    return Error{ErrorCode::bad_argument,
                 "row " + std::to_string(camera_row) + " is not in 0.." + std::to_string(grid.rows - 1)};
  RowPixels pixels;
  for (std::size_t t = 0; t < camera_.order().size(); ++t)
    if (camera_.order()[t] / grid.cols == camera_row)
      pixels.emplace_back(static_cast<std::int32_t>(t), camera_.order()[t] % grid.cols);
  return pixels;
}

Result<Image<float>> TransportTensor::slice(int camera_row, int channel) const {
  SYMRIG_TRY(const RowPixels pixels, row_pixels(camera_row));
  Image<float> out(Grid{camera_.grid().cols, camera_.grid().cols});
  const auto add = [&out](std::int32_t i, std::int32_t j, int x, int u, bool mirrored, float value) {
    out.at(x, u) += value;
    if (mirrored && i != j) out.at(u, x) += value;
  };
  SYMRIG_CHECK(visit_leaves([&](const Leaf& leaf, std::span<const float> factors) {
    const std::int64_t size = std::int64_t{leaf.rank} * (leaf.rows() + leaf.cols());
    const float* a = factors.data() + channel * size;
    const float* b = a + std::int64_t{leaf.rank} * leaf.rows();
    for_entries(pixels, leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end,
                [&](std::int32_t i, std::int32_t j, int x, int u) {
                  float value = 0;
                  for (std::int64_t k = 0; k < leaf.rank; ++k)
                    value +=
                        a[k * leaf.rows() + i - leaf.row_begin] * b[k * leaf.cols() + j - leaf.col_begin];
                  add(i, j, x, u, leaf.row_begin != leaf.col_begin, value);
                });
  }));
  const std::vector<float> values = scalar_values();
  auto value = static_cast<std::size_t>(channel);
  for (const ScalarLeaf& s : scalars()) {
    for_entries(pixels, s.row, s.row + 1, s.col, s.col + 1,
                [&](std::int32_t i, std::int32_t j, int x, int u) { add(i, j, x, u, true, values[value]); });
    value += static_cast<std::size_t>(channels_);
  }
  for (const BandLeaf& band : bands()) add_band_row(band, camera_.grid(), camera_row, channel, out);
  return out;
}

Result<Image<float>> TransportTensor::level_map(int camera_row) const {
  SYMRIG_TRY(const RowPixels pixels, row_pixels(camera_row));
  Image<float> out(Grid{camera_.grid().cols, camera_.grid().cols}, 1, -1.0F);
  const auto paint = [&](std::int32_t row_begin, std::int32_t row_end, std::int32_t col_begin,
                         std::int32_t col_end, int level) {
    for_entries(pixels, row_begin, row_end, col_begin, col_end,
                [&](std::int32_t, std::int32_t, int x, int u) {
                  // If leaves overlap, the finest one counts.
                  out.at(x, u) = out.at(u, x) = std::max(out.at(x, u), static_cast<float>(level));
                });
  };
  for (const Leaf& leaf : leaves())
    paint(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.level);
  for (int l = 0; l < levels(); ++l) {
    for (const EmptyLeaf& empty : empties(l)) {
      const Block& i = camera_.level(l)[empty.row_block];
      const Block& j = camera_.level(l)[empty.col_block];
      paint(i.begin, i.end, j.begin, j.end, l);
    }
  }
  for (const ScalarLeaf& s : scalars()) paint(s.row, s.row + 1, s.col, s.col + 1, scalar_level(s));
  for (const BandLeaf& band : bands()) paint_band(band, camera_.levels() - 1, out);
  return out;
}

}  // namespace symrig
