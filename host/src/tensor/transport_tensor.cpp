// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/transport_tensor.hpp"

#include "tensor/store.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace symrig {

const tensor::Store& TransportTensor::store() const {
  static const tensor::Store nothing;
  return store_ ? *store_ : nothing;
}

std::span<const Leaf> TransportTensor::leaves() const& {
  return draft_ ? draft_->leaves : store().leaves;
}

bool TransportTensor::in_memory() const {
  return store().parts.in_memory();
}

Result<void> TransportTensor::visit_leaves(const UseLeaf& use) const {
  if (!draft_) return store().parts.visit_factors(store().leaves, use);
  std::size_t at = 0;
  for (const Leaf& leaf : draft_->leaves) {
    const std::size_t size = leaf.values(channels_);
    use(leaf, std::span(draft_->factors).subspan(at, size));
    at += size;
  }
  return {};
}

Result<std::vector<float>> TransportTensor::factors() const {
  std::vector<float> all;
  SYMRIG_CHECK(visit_leaves([&](const Leaf&, std::span<const float> factors) {
    all.insert(all.end(), factors.begin(), factors.end());
  }));
  return all;
}

std::vector<EmptyLeaf> TransportTensor::empties(int level) const {
  const std::size_t l = level;
  return draft_ ? draft_->empties[l] : store().empties[l].leaves();
}

std::int64_t TransportTensor::empty_count(int level) const {
  const std::size_t l = level;
  return draft_ ? std::ssize(draft_->empties[l]) : store().empties[l].size();
}

/// Symmetric tensors store an entry and its mirror image. Only the one below the diagonal is listed.
bool TransportTensor::listed(const ScalarLeaf& scalar) const {
  return !symmetric_ || scalar.row > scalar.col;
}

std::vector<ScalarLeaf> TransportTensor::scalars() const {
  if (draft_) return draft_->scalars;
  std::vector<ScalarLeaf> all;
  const tensor::Diagonal& diagonal = store().diagonal;
  if (!diagonal.empty())
    for (std::int32_t i = 0; i < camera_grid().size(); ++i)
      if (diagonal.holds(i)) all.push_back({i, i});
  for (std::size_t k = 0; k < store().entries[0].size(); ++k)
    if (listed(store().entries[0].at(k))) all.push_back(store().entries[0].at(k));
  return all;
}

std::int64_t TransportTensor::scalar_count() const {
  if (draft_) return std::ssize(draft_->scalars);
  return store().diagonal.size() +
         static_cast<std::int64_t>(store().entries[0].size()) / (symmetric_ ? 2 : 1);
}

std::vector<float> TransportTensor::scalar_values() const {
  if (draft_) return draft_->scalar_values;
  std::vector<float> all;
  const tensor::Diagonal& diagonal = store().diagonal;
  if (!diagonal.empty())
    for (std::int32_t i = 0; i < camera_grid().size(); ++i)
      for (int channel = 0; diagonal.holds(i) && channel < channels_; ++channel)
        all.push_back(diagonal.values(channel)[i]);
  const tensor::Entries& entries = store().entries[0];
  for (std::size_t k = 0; k < entries.size(); ++k)
    for (int channel = 0; listed(entries.at(k)) && channel < channels_; ++channel)
      all.push_back(entries.value(k, channel));
  return all;
}

std::vector<BandLeaf> TransportTensor::bands() const {
  if (draft_) return draft_->bands;
  std::vector<BandLeaf> all;
  for (const tensor::Band& band : store().bands) all.push_back({band.radius(), band.values()});
  return all;
}

std::span<const SparseColumn> TransportTensor::columns() const {
  return draft_ ? draft_->columns.ranges : store().columns.ranges;
}

std::span<const std::int32_t> TransportTensor::column_rows() const {
  return draft_ ? draft_->columns.rows : store().columns.rows;
}

std::span<const float> TransportTensor::column_values() const {
  return draft_ ? draft_->columns.values : store().columns.values;
}

int TransportTensor::levels() const {
  return static_cast<int>(draft_ ? draft_->empties.size() : store().empties.size());
}

int TransportTensor::scalar_level(const ScalarLeaf& scalar) const {
  return std::max(camera_.pixel_level(scalar.row), projector_tree().pixel_level(scalar.col));
}

std::vector<LeafCounts> TransportTensor::leaves_per_level() const {
  std::vector<LeafCounts> counts(levels());
  for (const Leaf& leaf : leaves()) {
    LeafCounts& at = counts[leaf.level];
    ++(leaf.rank == 1 ? at.rank1 : at.low_rank);
  }
  for (int l = 0; l < levels(); ++l) counts[l].empty = empty_count(l);
  for (const ScalarLeaf& scalar : scalars()) ++counts[scalar_level(scalar)].scalar;
  if (!column_rows().empty()) counts.back().scalar += std::ssize(column_rows());
  return counts;
}

std::int64_t TransportTensor::bytes() const {
  return store().bytes();
}

double TransportTensor::dense_bytes() const {
  return static_cast<double>(camera_grid().size()) * static_cast<double>(projector_grid().size()) *
         channels_ * sizeof(float);
}

Result<Image<float>> apply_adjoint(const TransportTensor& tensor, const Image<float>& picture) {
  if (picture.grid() != tensor.camera_grid() || picture.channels() != tensor.channels())
    return Error{ErrorCode::size_mismatch,
                 "the picture is " + to_string(picture.grid()) + " with " +
                     std::to_string(picture.channels()) + " channels, the camera " +
                     to_string(tensor.camera_grid()) + " with " + std::to_string(tensor.channels()),
                 "give a picture of the size of the scene's photographs"};
  std::vector<float> y(picture.plane(0).size()), p(tensor.projector_grid().size());
  for (int channel = 0; channel < tensor.channels(); ++channel) {
    tensor.camera_tree().to_tree(picture.plane(channel), y);
    SYMRIG_CHECK(tensor.add_tree(y, p, channel, true));
  }
  Image<float> light(tensor.projector_grid());
  tensor.projector_tree().to_raster(p, light.plane(0));
  return light;
}

Result<Image<float>> TransportTensor::adjoint(const Image<float>& picture) const {
  return apply_adjoint(*this, picture);
}

// Slices of T [Garg06 Fig. 2c] and the level of the leaf behind each entry [Garg06 Fig. 2d].

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
