// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/direct_light.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include <tbb/blocked_range.h>
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

DirectLight::DirectLight(const KnownTransport& known, std::size_t pixels, Model model)
    : entry_(pixels, -1),
      model_(std::move(model)),
      weighted_residual_(model_.least.size() * pixels),
      weight_(model_.least.size() * pixels) {
  const auto scalars = known.scalars();
  for (std::size_t k = 0; k < scalars.size(); ++k)
    if (scalars[k].row == scalars[k].col) entry_[scalars[k].row] = static_cast<std::int32_t>(k);
}

/// What a sample of channel · pixels + pixel may miss, with `share` of all pixels lit.
double DirectLight::variance(std::size_t at, double measured, double share) const {
  const std::size_t channel = at / entry_.size();
  return measured + model_.least[channel] + 4 * share * share * model_.half[channel];
}

void DirectLight::add(std::span<const TreePhotograph> residuals) {
  const std::size_t pixels = entry_.size();
  std::vector<double> lit_share;
  for (const TreePhotograph& photograph : residuals)
    lit_share.push_back(std::accumulate(photograph.pattern.begin(), photograph.pattern.end(), 0.0) /
                        static_cast<double>(pixels));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, weight_.size(), 4096), [&](const auto& range) {
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const TreePhotograph& photograph = residuals[k];
      for (std::size_t at = range.begin(); at < range.end(); ++at) {
        const double lit = photograph.pattern[at % pixels];
        if (lit == 0 || photograph.valid[at] == 0) continue;
        const double v = variance(at, static_cast<double>(photograph.variance[at]), lit_share[k]);
        if (v <= 0) continue;
        weighted_residual_[at] += lit * static_cast<double>(photograph.mean[at]) / v;
        weight_[at] += lit * lit / v;
      }
    }
  });
}

void DirectLight::add(const LevelLight& level, const LaterLight& later, const KnownTransport& known) {
  const std::size_t pixels = entry_.size();
  const std::size_t channels = model_.least.size();
  const int child_level = std::min(level.level + 1, later.levels() - 1);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, weight_.size(), 4096), [&](const auto& range) {
    for (std::size_t at = range.begin(); at < range.end(); ++at) {
      const std::size_t t = at % pixels;
      if (entry_[t] < 0 || level.variance[at] < 0) continue;
      const double v =
          variance(at, static_cast<double>(level.variance[at]), static_cast<double>(level.lit_share[t]));
      if (v <= 0) continue;
      const auto direct = static_cast<double>(
          known.scalar_values()[static_cast<std::size_t>(entry_[t]) * channels + at / pixels]);
      const auto within = static_cast<double>(later.within(child_level, at));
      weighted_residual_[at] += (static_cast<double>(level.residual[at]) - direct - within) / v;
      weight_[at] += 1 / v;
    }
  });
}

void DirectLight::apply(KnownTransport& known) const {
  const std::size_t pixels = entry_.size();
  const std::size_t channels = model_.least.size();
  const std::span<float> values = known.change_scalar_values();
  for (std::size_t i = 0; i < pixels; ++i) {
    if (entry_[i] < 0) continue;
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const std::size_t at = channel * pixels + i;
      if (weight_[at] > 0)
        values[static_cast<std::size_t>(entry_[i]) * channels + channel] +=
            static_cast<float>(weighted_residual_[at] / weight_[at]);
    }
  }
}

}  // namespace symrig::acquisition
