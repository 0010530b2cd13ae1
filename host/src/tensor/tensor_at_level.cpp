// SPDX-License-Identifier: Apache-2.0
// The tensor as it was when the acquisition had reached a level [Garg06 Fig. 11].
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <string>
#include <utility>

namespace symrig {
namespace {

/// A pair of blocks (P, Q) of one level and the pictures of its rank-1 estimate: c = T_PQ 1 on P, r = T_QP 1
/// on Q, channel after channel.
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

/// If s is a smaller share of the light than this, 1/s only magnifies rounding errors.
constexpr double kLeastShare = 1e-9;

/// Adds the deep leaves of a symmetric tensor to their ancestors at one level.
class Gathering {
 public:
  Gathering(std::span<const Block> blocks, int channels, WithinBlocks within)
      : blocks_(blocks), channels_(static_cast<std::size_t>(channels)), within_(within) {}

  /// Adds the row sums `rows` on [row_begin, …) and the column sums `cols` on [col_begin, …) of one leaf and
  /// channel.
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
    // Below a diagonal ancestor, an off-diagonal leaf also stands for its mirror image.
    if (key.first == key.second && row_begin != col_begin) {
      put(at.c, p, col_begin, cols);
      put(at.r, q, row_begin, rows);
    }
  }

  /// T_PQ ≈ (c/√s)(r/√s)', s = Σc: the estimate of the acquisition before it split the node. [Garg06 §5.2]
  /// If light and its negative cancel out, s has no meaning and the estimate is 0.
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
    const std::size_t pixels = block.size();
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

/// Calls visit(at, value, channel) for each non-zero entry of a band.
template <class Visit>
void for_band_entries(const BlockTree& tree, int channels, const BandLeaf& band, const Visit& visit) {
  const Grid grid = tree.grid();
  const std::size_t pixels = grid.size();
  std::vector<std::int32_t> tree_index(pixels);
  for (std::size_t t = 0; t < pixels; ++t) tree_index[tree.order()[t]] = static_cast<std::int32_t>(t);
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

/// A Bᵀ 1: the sum of each row of a leaf.
std::vector<double> row_sums(const float* a, std::int32_t rows, const float* b, std::int32_t cols, int rank) {
  std::vector<double> sums(rows);
  for (int k = 0; k < rank; ++k, a += rows, b += cols) {
    const double light = std::accumulate(b, b + cols, 0.0);
    for (std::int32_t i = 0; i < rows; ++i) sums[i] += light * static_cast<double>(a[i]);
  }
  return sums;
}

/// Cuts a tensor at a level: adds deeper leaves to their ancestors.
class Cut {
 public:
  Cut(const TransportTensor& tensor, int level, WithinBlocks within)
      : tensor_(tensor),
        level_(level),
        last_(std::clamp(level, 0, tensor.camera_tree().levels() - 1)),
        channels_(tensor.channels()),
        builder_(tensor.camera_tree(), channels_),
        deeper_(tensor.camera_tree().level(last_), channels_, within) {}

  Result<TransportTensor> run(bool merged_is_deeper) && {
    SYMRIG_CHECK(cut_leaves(merged_is_deeper));
    cut_scalars();
    cut_bands();
    for (int l = 0; l <= std::min(level_, tensor_.levels() - 1); ++l)
      for (const EmptyLeaf& empty : tensor_.empties(l))
        builder_.add_empty(l, empty.row_block, empty.col_block);
    deeper_.append_to(builder_, last_);
    return std::move(builder_).finish();
  }

 private:
  /// True if the leaf is between two whole blocks and was merged from leaves between their children.
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

  Result<void> cut_leaves(bool merged_is_deeper) {
    return tensor_.visit_leaves([&](const Leaf& leaf, std::span<const float> factors) {
      const bool stays = leaf.level + (merged_is_deeper && merged(leaf) ? 1 : 0) <= level_;
      if (stays)
        builder_.add_leaf(leaf.row_begin, leaf.row_end, leaf.col_begin, leaf.col_end, leaf.rank, leaf.level,
                          factors);
      const std::size_t size = factors.size() / static_cast<std::size_t>(channels_);
      for (std::size_t channel = 0; !stays && channel < static_cast<std::size_t>(channels_); ++channel)
        gather(leaf, factors.data() + channel * size, channel);
    });
  }

  void gather(const ScalarLeaf& at, float value, std::size_t channel) {
    const double one = value;
    deeper_.add(at.row, std::span(&one, 1), at.col, std::span(&one, 1), channel);
  }

  void cut_scalars() {
    const std::vector<float> values = tensor_.scalar_values();
    std::size_t first = 0;
    for (const ScalarLeaf& scalar : tensor_.scalars()) {
      const auto of_scalar = std::span(values).subspan(first, channels_);
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

Result<TransportTensor> TransportTensor::stopped_at(int level) const {
  return Cut(*this, level, WithinBlocks::product).run(false);
}

Result<TransportTensor> stopped_capture(const TransportTensor& tensor, int level, WithinBlocks within) {
  return Cut(tensor, level, within).run(true);
}

}  // namespace symrig
