// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/level_light.hpp"

#include <algorithm>
#include <numeric>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {
namespace {

/// The deepest level at which two pixels, x ≤ y, lie in one block.
int common_level(const BlockTree& tree, std::int32_t x, std::int32_t y) {
  std::size_t block = 0;
  for (int level = 0; level + 1 < tree.levels(); ++level) {
    const Block& around = tree.level(level)[block];
    const auto children = tree.level(level + 1);
    block = static_cast<std::size_t>(around.first_child);
    while (children[block].end <= x) ++block;
    if (children[block].end <= y) return level;
  }
  return tree.levels() - 1;
}

/// y += w a.
void add(std::span<const float> a, float w, float* y) {
  for (std::size_t i = 0; i < a.size(); ++i) y[i] += w * a[i];
}

float sum(std::span<const float> v) {
  return static_cast<float>(std::accumulate(v.begin(), v.end(), 0.0));
}

}  // namespace

void LevelLight::keep(const TreePhotograph& photograph, const LitBlocks& lit, float share) {
  const std::size_t pixels = lit_share.size();
  for (const LitRange& range : lit) {
    std::fill(lit_share.begin() + range.begin, lit_share.begin() + range.end, share);
    for (std::size_t base = 0; base < residual.size(); base += pixels)
      for (std::size_t at = base + static_cast<std::size_t>(range.begin);
           at < base + static_cast<std::size_t>(range.end); ++at) {
        residual[at] = photograph.mean[at];
        variance[at] = photograph.valid[at] != 0 ? photograph.variance[at] : kNone;
      }
  }
}

/// First by the smallest block that holds both ends of the transport, then summed from small blocks to large.
LaterLight::LaterLight(const KnownTransport& known, const BlockTree& tree, int channels) {
  const std::size_t pixels = tree.order().size();
  within_.assign(static_cast<std::size_t>(tree.levels()),
                 PagedVector<float>(pixels * static_cast<std::size_t>(channels)));
  std::vector<int> level_of_leaf, level_of_scalar;
  for (const KnownLeaf& leaf : known.leaves())
    level_of_leaf.push_back(common_level(tree, std::min(leaf.row_begin, leaf.col_begin),
                                         std::max(leaf.row_begin, leaf.col_begin)));
  for (const ScalarLeaf& s : known.scalars())
    level_of_scalar.push_back(
        s.row == s.col ? -1 : common_level(tree, std::min(s.row, s.col), std::max(s.row, s.col)));
  tbb::parallel_for(0, channels, [&](int channel) {
    const auto plane = static_cast<std::size_t>(channel) * pixels;
    for (std::size_t n = 0; n < level_of_leaf.size(); ++n) {
      const KnownLeaf& leaf = known.leaves()[n];
      if (leaf.removed) continue;
      const auto [a, b] = known.sides(leaf, channel);
      // A diagonal leaf lies in its own block.
      float* const into = within_[leaf.diagonal() ? leaf.level : level_of_leaf[n]].data() + plane;
      add(a, sum(b), into + leaf.row_begin);
      if (!leaf.diagonal()) add(b, sum(a), into + leaf.col_begin);
    }
    for (std::size_t n = 0; n < level_of_scalar.size(); ++n) {
      if (level_of_scalar[n] < 0) continue;
      const ScalarLeaf& s = known.scalars()[n];
      const float value =
          known.scalar_values()[n * static_cast<std::size_t>(channels) + static_cast<std::size_t>(channel)];
      float* const into = within_[level_of_scalar[n]].data() + plane;
      into[s.row] += value;
      into[s.col] += value;
    }
    for (std::size_t l = within_.size(); l-- > 1;)
      add(std::span(within_[l]).subspan(plane, pixels), 1, within_[l - 1].data() + plane);
  });
}

}  // namespace symrig::acquisition
