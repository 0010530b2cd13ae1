// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/direct_light.hpp"
#include "symrig/base/statistics.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::level_light_test {
namespace {

constexpr Grid kGrid{12, 9};
constexpr std::size_t kPixels = 108;
constexpr int kChannels = 2;
constexpr double kEpsilon = 0x1p-24;

std::vector<float> values(Random& random, std::size_t n) {
  std::vector<float> v(n);
  for (float& x : v) x = static_cast<float>(random.uniform());
  return v;
}

/// Transport by its entries, and the same in leaves and scalars.
class Both {
 public:
  Both() : tree(kGrid), known(tree, kChannels), t_(kChannels * kPixels * kPixels) {}

  void leaf(int level, std::size_t i, std::size_t j, Random& random) {
    const Block& row = tree.level(level)[i];
    const Block& col = tree.level(level)[j];
    const std::size_t rows = row.size();
    const std::size_t cols = col.size();
    std::vector<float> factors;
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
      const auto a = values(random, rows);
      const auto b = i == j ? a : values(random, cols);
      factors.insert(factors.end(), a.begin(), a.end());
      factors.insert(factors.end(), b.begin(), b.end());
      for (std::size_t x = 0; x < rows; ++x)
        for (std::size_t y = 0; y < cols; ++y)
          add(channel, static_cast<std::size_t>(row.begin) + x, static_cast<std::size_t>(col.begin) + y,
              static_cast<double>(a[x]) * static_cast<double>(b[y]), i != j);
    }
    known.add_leaf(row.begin, row.end, col.begin, col.end, level, factors);
  }
  void scalar(std::int32_t row, std::int32_t col, Random& random) {
    const auto value = values(random, kChannels);
    known.add_scalar(row, col, value);
    for (std::size_t channel = 0; channel < kChannels; ++channel)
      add(channel, static_cast<std::size_t>(row), static_cast<std::size_t>(col),
          static_cast<double>(value[channel]), row != col);
  }
  double entry(std::size_t channel, std::size_t row, std::size_t col) const {
    return t_[(channel * kPixels + row) * kPixels + col];
  }

  BlockTree tree;
  KnownTransport known;

 private:
  void add(std::size_t channel, std::size_t row, std::size_t col, double value, bool mirrored) {
    t_[(channel * kPixels + row) * kPixels + col] += value;
    if (mirrored) t_[(channel * kPixels + col) * kPixels + row] += value;
  }
  std::vector<double> t_;
};

const Block& block_around(const BlockTree& tree, int level, std::size_t t) {
  for (const Block& block : tree.level(level))
    if (static_cast<std::size_t>(block.end) > t) return block;
  return tree.level(level).back();
}

/// Off-diagonal transport between all pairs of blocks within each block of level 1, on levels 2 and 3, some
/// of it removed again; scalars next to the diagonal and far from it.
void fill(Both& both, Random& random) {
  for (int level = 2; level <= 3; ++level) {
    const auto blocks = both.tree.level(level);
    for (std::size_t i = 0; i < blocks.size(); ++i)
      for (std::size_t j = 0; j < i; j += static_cast<std::size_t>(level)) both.leaf(level, i, j, random);
  }
  const auto factors = values(random, 2 * kPixels * kChannels);
  both.known.remove_leaf(both.known.add_leaf(0, kPixels, 0, kPixels, 0, factors));
  for (std::int32_t t = 1; t < std::int32_t{kPixels}; ++t) {
    both.scalar(t, t - 1, random);
    both.scalar(t, (t * 7) % t, random);
  }
}

TEST(LaterLight, is_what_a_lit_block_sends_to_its_own_pixels) {
  Random random(1);
  Both both;
  fill(both, random);
  for (std::int32_t t = 0; t < std::int32_t{kPixels}; ++t)
    both.known.add_scalar(t, t, std::vector<float>(kChannels, 1.0F));  // direct light does not count
  const LaterLight later(both.known, both.tree, kChannels);
  ASSERT_EQ(later.levels(), both.tree.levels());
  for (int level = 0; level < later.levels(); ++level)
    for (std::size_t channel = 0; channel < kChannels; ++channel)
      for (std::size_t t = 0; t < kPixels; ++t) {
        const Block& around = block_around(both.tree, level, t);
        double expected = 0;
        for (std::int32_t j = around.begin; j < around.end; ++j)
          expected += both.entry(channel, t, static_cast<std::size_t>(j));
        // Positive terms, added one by one over leaves, pixels and levels.
        EXPECT_NEAR(static_cast<double>(later.within(level, channel * kPixels + t)), expected,
                    (4 * around.size() + 40) * kEpsilon * expected)
            << "level " << level << ", channel " << channel << ", pixel " << t;
      }
}

TEST(LaterLight, of_a_block_with_itself_counts_from_that_block_up) {
  Random random(3);
  Both both;
  both.leaf(2, 1, 1, random);
  const Block& block = both.tree.level(2)[1];
  const LaterLight later(both.known, both.tree, kChannels);
  const std::size_t t = block.begin;
  double expected = 0;
  for (std::int32_t j = block.begin; j < block.end; ++j)
    expected += both.entry(0, t, static_cast<std::size_t>(j));
  for (int level = 0; level < later.levels(); ++level)
    EXPECT_NEAR(static_cast<double>(later.within(level, t)), level <= 2 ? expected : 0,
                4 * block.size() * kEpsilon * expected)
        << level;
}

/// Photographs of one level of a scene whose transport between blocks is known before, and within blocks
/// after: what LevelLight keeps must move the direct light as whole photographs do.
TEST(LevelLight, moves_the_direct_light_as_whole_photographs_do) {
  constexpr int kLevel = 1;
  Random random(2);
  Both both;
  const auto blocks = both.tree.level(kLevel);
  for (std::size_t i = 0; i < blocks.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) both.leaf(kLevel, i, j, random);

  std::vector<TreePhotograph> whole;
  std::vector<LitBlocks> lit;
  for (int slot = 0; slot < 4; ++slot) {
    LitBlocks ranges;
    TreePhotograph p{std::vector<float>(kPixels), values(random, kChannels * kPixels),
                     values(random, kChannels * kPixels), std::vector<std::uint8_t>(kChannels * kPixels, 1)};
    for (const Block& block : blocks) {
      if (slot >= block.children) continue;
      const std::int32_t lit_child = block.first_child + slot;
      const Block& child = both.tree.level(kLevel + 1)[lit_child];
      ranges.push_back({child.begin, child.end});
      for (std::int32_t t = child.begin; t < child.end; ++t) p.pattern[t] = 1;
    }
    for (float& mean : p.mean) mean *= 10;
    p.valid[7] = 0;
    whole.push_back(std::move(p));
    lit.push_back(std::move(ranges));
  }
  auto at_the_time = whole;
  both.known.subtract_from(at_the_time);
  LevelLight light(kLevel, {0, 4}, kPixels, kChannels);
  for (std::size_t k = 0; k < 4; ++k) {
    double area = 0;
    for (const LitRange& range : lit[k]) area += range.end - range.begin;
    light.keep(at_the_time[k], lit[k], static_cast<float>(area / kPixels));
  }

  // What is found later: within the children, between children, and direct light.
  for (int level = kLevel + 1; level <= kLevel + 2; ++level)
    for (std::size_t i = 0; i < both.tree.level(level).size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (&block_around(both.tree, kLevel, static_cast<std::size_t>(both.tree.level(level)[i].begin)) ==
            &block_around(both.tree, kLevel, static_cast<std::size_t>(both.tree.level(level)[j].begin)))
          both.leaf(level, i, j, random);
  for (std::int32_t t = 0; t < std::int32_t{kPixels}; ++t) both.scalar(t, t, random);

  const auto refined = [&](const auto& add) {
    KnownTransport known = both.known;
    DirectLight direct(known, kPixels,
                       {std::vector<double>(kChannels, 0.1), std::vector<double>(kChannels, 0.2)});
    add(direct, known);
    direct.apply(known);
    return std::vector<float>(known.scalar_values().begin(), known.scalar_values().end());
  };
  const auto by_level = refined([&](DirectLight& direct, const KnownTransport& known) {
    direct.add(light, LaterLight(known, both.tree, kChannels), known);
  });
  const auto by_photographs = refined([&](DirectLight& direct, const KnownTransport& known) {
    auto left = whole;
    known.subtract_from(left);
    direct.add(left);
  });
  // Each entry moves by one residual: a photograph up to 10, less up to 108 entries of at most 2 leaves each.
  constexpr double kLargest = 10 + 2 * 108;
  for (std::size_t at = 0; at < by_level.size(); ++at)
    EXPECT_NEAR(static_cast<double>(by_level[at]), static_cast<double>(by_photographs[at]),
                (2 * kPixels + 8) * kEpsilon * kLargest)
        << at;
}

}  // namespace
}  // namespace symrig::acquisition::level_light_test
