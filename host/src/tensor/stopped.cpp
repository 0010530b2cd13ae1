// SPDX-License-Identifier: Apache-2.0
// Pictures of the hierarchy: the tensor as it stood at a level (Fig. 11), and slices of T (Fig. 2c, 2d).
#include "symrig/tensor/stopped.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <string>
#include <utility>

namespace symrig {
namespace {

/// The blocks (P, Q) of one level and the images of its rank-1 estimate: c = T_PQ 1 on P, r = T_QP 1 on Q,
/// channel after channel.
struct Ancestor {
  std::vector<double> c, r;
};

std::size_t block_of(std::span<const Block> blocks, std::int32_t pixel) {
  const auto after = std::upper_bound(blocks.begin(), blocks.end(), pixel,
                                      [](std::int32_t p, const Block& b) { return p < b.begin; });
  return static_cast<std::size_t>(after - blocks.begin()) - 1;
}

double sum_of_sizes(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0,
                         [](double sum, double v) { return sum + std::abs(v); });
}

/// With less of the light than this left over, 1/s only magnifies rounding.
constexpr double kLeastShare = 1e-9;

/// Gathers the deep leaves of a symmetric tensor under their ancestors at one level.
class Gathering {
 public:
  Gathering(std::span<const Block> blocks, int channels, WithinBlocks within)
      : blocks_(blocks), channels_(static_cast<std::size_t>(channels)), within_(within) {}

  /// Row sums `rows` on [row_begin, …) and column sums `cols` on [col_begin, …) of one leaf and one channel.
  void add(std::int32_t row_begin, std::span<const double> rows, std::int32_t col_begin,
           std::span<const double> cols, std::size_t channel) {
    const std::pair key{block_of(blocks_, row_begin), block_of(blocks_, col_begin)};
    const Block& p = blocks_[key.first];
    const Block& q = blocks_[key.second];
    Ancestor& at = ancestors_[key];
    at.c.resize(channels_ * static_cast<std::size_t>(p.size()));
    at.r.resize(channels_ * static_cast<std::size_t>(q.size()));
    const auto put = [channel](std::vector<double>& image, const Block& block, std::int32_t begin,
                               std::span<const double> values) {
      const std::size_t offset =
          channel * static_cast<std::size_t>(block.size()) + static_cast<std::size_t>(begin - block.begin);
      for (std::size_t i = 0; i < values.size(); ++i) image[offset + i] += values[i];
    };
    put(at.c, p, row_begin, rows);
    put(at.r, q, col_begin, cols);
    // Below a diagonal ancestor an off-diagonal leaf stands for its mirror image too.
    if (key.first == key.second && row_begin != col_begin) {
      put(at.c, p, col_begin, cols);
      put(at.r, q, row_begin, rows);
    }
  }

  /// T_PQ ≈ (c/√s)(r/√s)', s = Σc: the estimate the acquisition had before it went deeper. [Garg06 §5.2]
  /// Where light and its negative cancel out, s says nothing and the estimate is 0.
  void append_to(TensorBuilder& builder, int level) const {
    std::vector<float> factors;
    for (const auto& [key, node] : ancestors_) {
      if (within_ == WithinBlocks::direct && key.first == key.second) {
        append_direct(builder, blocks_[key.first], node.c);
        continue;
      }
      const Block& p = blocks_[key.first];
      const Block& q = blocks_[key.second];
      factors.clear();
      for (std::size_t channel = 0; channel < channels_; ++channel) {
        const auto c = std::span(node.c).subspan(channel * static_cast<std::size_t>(p.size()),
                                                 static_cast<std::size_t>(p.size()));
        const auto r = std::span(node.r).subspan(channel * static_cast<std::size_t>(q.size()),
                                                 static_cast<std::size_t>(q.size()));
        const double s =
            0.5 * (std::accumulate(c.begin(), c.end(), 0.0) + std::accumulate(r.begin(), r.end(), 0.0));
        const double scale = s > kLeastShare * (sum_of_sizes(c) + sum_of_sizes(r)) ? 1 / std::sqrt(s) : 0;
        for (const double v : c) factors.push_back(static_cast<float>(v * scale));
        for (const double v : r) factors.push_back(static_cast<float>(v * scale));
      }
      builder.add_leaf(p.begin, p.end, q.begin, q.end, 1, level, factors);
    }
  }

 private:
  void append_direct(TensorBuilder& builder, const Block& block, std::span<const double> c) const {
    const auto pixels = static_cast<std::size_t>(block.size());
    std::vector<float> values(channels_);
    for (std::int32_t i = 0; i < block.size(); ++i) {
      for (std::size_t channel = 0; channel < channels_; ++channel)
        values[channel] = static_cast<float>(c[channel * pixels + static_cast<std::size_t>(i)]);
      builder.add_scalar(block.begin + i, block.begin + i, values);
    }
  }

  std::span<const Block> blocks_;
  std::size_t channels_;
  WithinBlocks within_;
  std::map<std::pair<std::size_t, std::size_t>, Ancestor> ancestors_;
};

/// visit(at, value, channel): the entries of a band as scalars, those that are not 0.
template <class Visit>
void for_band_entries(const BlockTree& tree, int channels, const BandLeaf& band, const Visit& visit) {
  const Grid grid = tree.grid();
  const auto pixels = static_cast<std::size_t>(grid.size());
  std::vector<std::int32_t> tree_index(pixels);
  for (std::size_t t = 0; t < pixels; ++t)
    tree_index[static_cast<std::size_t>(tree.order()[t])] = static_cast<std::int32_t>(t);
  std::size_t at = 0;
  for (int channel = 0; channel < channels; ++channel) {
    for (const auto& [dy, dx] : band_offsets(band.radius)) {
      const auto step = static_cast<std::ptrdiff_t>(dy) * grid.cols + dx;
      for (std::size_t i = 0; i < pixels; ++i, ++at)
        if (band.values[at] != 0.0F)
          visit(ScalarLeaf{tree_index[i + static_cast<std::size_t>(step)], tree_index[i]}, band.values[at],
                static_cast<std::size_t>(channel));
    }
  }
}

/// A Bᵀ 1: what each row of a leaf sums to.
std::vector<double> row_sums(const float* a, std::int32_t rows, const float* b, std::int32_t cols, int rank) {
  std::vector<double> sums(static_cast<std::size_t>(rows));
  for (int k = 0; k < rank; ++k, a += rows, b += cols) {
    const double light = std::accumulate(b, b + cols, 0.0);
    for (std::int32_t i = 0; i < rows; ++i)
      sums[static_cast<std::size_t>(i)] += light * static_cast<double>(a[i]);
  }
  return sums;
}

/// Cuts a tensor at a level: what lies deeper is gathered under its ancestors.
class Cut {
 public:
  Cut(const TransportTensor& tensor, int level, WithinBlocks within)
      : tensor_(tensor),
        level_(level),
        last_(std::clamp(level, 0, tensor.camera_tree().levels() - 1)),
        channels_(tensor.channels()),
        builder_(tensor.camera_tree(), channels_),
        deeper_(tensor.camera_tree().level(last_), channels_, within) {}

  TransportTensor run(bool merged_is_deeper) && {
    cut_leaves(merged_is_deeper);
    cut_scalars();
    cut_bands();
    for (int l = 0; l <= std::min(level_, tensor_.levels() - 1); ++l)
      for (const EmptyLeaf& empty : tensor_.empties(l))
        builder_.add_empty(l, empty.row_block, empty.col_block);
    deeper_.append_to(builder_, last_);
    return std::move(builder_).finish();
  }

 private:
  /// True if a leaf between two whole blocks was made of leaves between their children.
  bool merged(const Leaf& leaf) const {
    if (leaf.rank < 2 || leaf.row_begin == leaf.col_begin || leaf.level + 1 >= tensor_.camera_tree().levels())
      return false;
    const auto blocks = tensor_.camera_tree().level(leaf.level);
    return blocks[block_of(blocks, leaf.row_begin)].size() == leaf.rows() &&
           blocks[block_of(blocks, leaf.col_begin)].size() == leaf.cols();
  }

  void gather(const Leaf& leaf, const float* a, std::size_t channel) {
    const float* b = a + std::int64_t{leaf.rank} * leaf.rows();
    deeper_.add(leaf.row_begin, row_sums(a, leaf.rows(), b, leaf.cols(), leaf.rank), leaf.col_begin,
                row_sums(b, leaf.cols(), a, leaf.rows(), leaf.rank), channel);
  }

  void cut_leaves(bool merged_is_deeper) {
    const std::vector<float> pool = tensor_.factors();
    const float* factors = pool.data();
    for (const Leaf& leaf : tensor_.leaves()) {
      const std::int64_t size = std::int64_t{leaf.rank} * (leaf.rows() + leaf.cols());
      const bool stays = leaf.level + (merged_is_deeper && merged(leaf) ? 1 : 0) <= level_;
      if (stays)
        builder_.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.rank, leaf.level,
                          std::span(factors, static_cast<std::size_t>(size * channels_)));
      for (int channel = 0; !stays && channel < channels_; ++channel)
        gather(leaf, factors + channel * size, static_cast<std::size_t>(channel));
      factors += size * channels_;
    }
  }

  void gather(const ScalarLeaf& at, float value, std::size_t channel) {
    const double one = value;
    deeper_.add(at.row, std::span(&one, 1), at.col, std::span(&one, 1), channel);
  }

  void cut_scalars() {
    const std::vector<float> values = tensor_.scalar_values();
    std::size_t first = 0;
    for (const ScalarLeaf& scalar : tensor_.scalars()) {
      const auto of_scalar = std::span(values).subspan(first, static_cast<std::size_t>(channels_));
      first += of_scalar.size();
      const bool stays = tensor_.scalar_level(scalar) <= level_;
      if (stays) builder_.add_scalar(scalar.row, scalar.col, of_scalar);
      for (std::size_t c = 0; !stays && c < of_scalar.size(); ++c) gather(scalar, of_scalar[c], c);
    }
  }

  void cut_bands() {
    for (const BandLeaf& band : tensor_.bands()) {
      if (level_ >= tensor_.levels() - 1)
        builder_.add_band(band.radius, band.values);
      else
        for_band_entries(
            tensor_.camera_tree(), channels_, band,
            [this](const ScalarLeaf& at, float value, std::size_t channel) { gather(at, value, channel); });
    }
  }

  const TransportTensor& tensor_;
  int level_, last_, channels_;
  TensorBuilder builder_;
  Gathering deeper_;
};

}  // namespace

TransportTensor TransportTensor::stopped_at(int level) const {
  return Cut(*this, level, WithinBlocks::product).run(false);
}

TransportTensor stopped_capture(const TransportTensor& tensor, int level, WithinBlocks within) {
  return Cut(tensor, level, within).run(true);
}

namespace {

using RowPixels = std::vector<std::pair<std::int32_t, int>>;  // (tree index, picture column), sorted

std::span<const std::pair<std::int32_t, int>> in_range(const RowPixels& pixels, std::int32_t begin,
                                                       std::int32_t end) {
  const auto at = [&](std::int32_t i) {
    return std::lower_bound(pixels.begin(), pixels.end(), std::pair{i, 0}) - pixels.begin();
  };
  return std::span(pixels).subspan(static_cast<std::size_t>(at(begin)),
                                   static_cast<std::size_t>(at(end) - at(begin)));
}

/// Calls paint(i, j, x, u) for each entry (i, j) of the block pair whose pixels lie in the picture row, at
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

/// A band's entries between pixels of one picture row: those with dy = 0, its first `radius` offsets.
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
                 "this one has different or one-sided measurements of its two sides"};
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
  const std::vector<float> pool = factors();
  const float* factors = pool.data();
  for (const Leaf& leaf : leaves()) {
    const std::int64_t size = std::int64_t{leaf.rank} * (leaf.rows() + leaf.cols());
    const float* a = factors + channel * size;
    const float* b = a + std::int64_t{leaf.rank} * leaf.rows();
    for_entries(pixels, leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end,
                [&](std::int32_t i, std::int32_t j, int x, int u) {
                  float value = 0;
                  for (std::int64_t k = 0; k < leaf.rank; ++k)
                    value +=
                        a[k * leaf.rows() + i - leaf.row_begin] * b[k * leaf.cols() + j - leaf.col_begin];
                  add(i, j, x, u, leaf.row_begin != leaf.col_begin, value);
                });
    factors += size * channels_;
  }
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
                  // Where leaves overlap, the finest one is shown.
                  out.at(x, u) = out.at(u, x) = std::max(out.at(x, u), static_cast<float>(level));
                });
  };
  for (const Leaf& leaf : leaves())
    paint(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.level);
  for (int l = 0; l < levels(); ++l) {
    for (const EmptyLeaf& empty : empties(l)) {
      const Block& i = camera_.level(l)[static_cast<std::size_t>(empty.row_block)];
      const Block& j = camera_.level(l)[static_cast<std::size_t>(empty.col_block)];
      paint(i.begin, i.end, j.begin, j.end, l);
    }
  }
  for (const ScalarLeaf& s : scalars()) paint(s.row, s.row + 1, s.col, s.col + 1, scalar_level(s));
  for (const BandLeaf& band : bands()) paint_band(band, camera_.levels() - 1, out);
  return out;
}

}  // namespace symrig
