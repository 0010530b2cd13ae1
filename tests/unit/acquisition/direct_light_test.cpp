// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/direct_light.hpp"

#include "symrig/base/statistics.hpp"
#include "workbench.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::direct_light_test {
namespace {

constexpr Grid kGrid{32, 32};
constexpr std::size_t kPixels = 1024;
constexpr double kSigmas = 5;

double truth(std::size_t pixel) {
  return 0.25 + 0.5 * Random(pixel).uniform();
}

/// A scene of direct light alone, `channels` alike, and its photographs.
class Direct {
 public:
  explicit Direct(int channels = 1)
      : tree_(kGrid), channels_(static_cast<std::size_t>(channels)), known(tree_, channels) {}

  /// Stores the diagonal, each entry wrong by `error`.
  void store(double error) {
    for (std::size_t t = 0; t < kPixels; ++t) {
      const std::vector<float> value(channels_, static_cast<float>(truth(t) + error));
      known.add_scalar(static_cast<std::int32_t>(t), static_cast<std::int32_t>(t), value);
    }
  }
  template <class Lit>
  TreePhotograph photograph(const Lit& lit, double sigma) {
    TreePhotograph p{std::vector<float>(kPixels), std::vector<float>(channels_ * kPixels),
                     std::vector<float>(channels_ * kPixels, static_cast<float>(sigma * sigma)),
                     std::vector<std::uint8_t>(channels_ * kPixels, 1)};
    for (std::size_t t = 0; t < kPixels; ++t) p.pattern[t] = lit(t);
    for (std::size_t at = 0; at < p.mean.size(); ++at) {
      const std::size_t t = at % kPixels;
      p.mean[at] = static_cast<float>(static_cast<double>(p.pattern[t]) *
                                          static_cast<double>(static_cast<float>(truth(t))) +
                                      sigma * gaussian_());
    }
    return p;
  }
  void refine(std::vector<TreePhotograph> photographs, DirectLight::Model model) {
    DirectLight direct(known, kPixels, std::move(model));
    known.subtract_from(photographs);
    direct.add(photographs);
    direct.apply(known);
  }
  double error(std::size_t pixel, std::size_t channel = 0) const {
    return static_cast<double>(known.scalar_values()[pixel * channels_ + channel]) -
           static_cast<double>(static_cast<float>(truth(pixel)));
  }

 private:
  BlockTree tree_;
  std::size_t channels_;
  tests::Gaussian gaussian_{77};

 public:
  KnownTransport known;
};

float everything(std::size_t /*pixel*/) {
  return 1;
}

TEST(DirectLight, noise_falls_with_the_root_of_the_times_lit) {
  constexpr double kSigma = 0.01;
  for (const int times : {1, 4, 16, 64}) {
    Direct scene;
    scene.store(0.03);  // where it starts does not matter
    std::vector<TreePhotograph> photographs;
    photographs.reserve(times);
    for (int k = 0; k < times; ++k) photographs.push_back(scene.photograph(everything, kSigma));
    scene.refine(std::move(photographs), {{0}, {0}});
    double squares = 0;
    for (std::size_t t = 0; t < kPixels; ++t) squares += std::pow(scene.error(t), 2);
    // n independent errors of variance σ²/times: their mean square is that, within √(2/n) (χ²).
    const double variance = kSigma * kSigma / times;
    EXPECT_NEAR(squares / kPixels, variance, kSigmas * variance * std::sqrt(2.0 / kPixels)) << times;
  }
}

TEST(DirectLight, each_pixel_gains_by_its_own_times_lit) {
  // Pixel t is lit in every photograph or in every fourth.
  constexpr double kSigma = 0.01;
  Direct scene;
  scene.store(0);
  std::vector<TreePhotograph> photographs;
  for (std::size_t k = 0; k < 32; ++k)
    photographs.push_back(
        scene.photograph([&](std::size_t t) { return t % 2 == 0 || k % 4 == 0 ? 1.0F : 0.0F; }, kSigma));
  scene.refine(std::move(photographs), {{0}, {0}});
  for (const std::size_t odd : {0U, 1U}) {
    double squares = 0;
    for (std::size_t t = odd; t < kPixels; t += 2) squares += std::pow(scene.error(t), 2);
    const double variance = kSigma * kSigma / (odd == 0 ? 32 : 8);
    EXPECT_NEAR(2 * squares / kPixels, variance, kSigmas * variance * std::sqrt(4.0 / kPixels)) << odd;
  }
}

TEST(DirectLight, a_noisier_photograph_counts_less) {
  // Variances σ² and 100 σ² weigh 1 and 1/100: together σ²/1.01, where a plain mean would have 101 σ²/4.
  constexpr double kSigma = 0.01;
  Direct scene;
  scene.store(0);
  scene.refine({scene.photograph(everything, kSigma), scene.photograph(everything, 10 * kSigma)}, {{0}, {0}});
  double squares = 0;
  for (std::size_t t = 0; t < kPixels; ++t) squares += std::pow(scene.error(t), 2);
  const double variance = kSigma * kSigma / 1.01;
  EXPECT_NEAR(squares / kPixels, variance, kSigmas * variance * std::sqrt(2.0 / kPixels));
}

TEST(DirectLight, exact_data_stay_exact_in_every_channel) {
  Direct scene(3);
  scene.store(0);
  scene.refine({scene.photograph(everything, 0),
                scene.photograph([](std::size_t t) { return t % 3 == 0 ? 1.0F : 0.0F; }, 0)},
               {{1e-6, 1e-6, 1e-6}, {1e-6, 0, 1}});
  for (std::size_t t = 0; t < kPixels; ++t)
    for (std::size_t channel = 0; channel < 3; ++channel) ASSERT_EQ(scene.error(t, channel), 0) << t;
}

TEST(DirectLight, exact_photographs_pull_a_wrong_entry_back) {
  Direct scene;
  scene.store(0.03);
  scene.refine({scene.photograph(everything, 0)}, {{1e-6}, {0}});
  // The residual of two floats below 1, then their sum: one rounding each.
  for (std::size_t t = 0; t < kPixels; ++t) ASSERT_NEAR(scene.error(t), 0, 2 * 0x1p-24) << t;
}

TEST(DirectLight, dark_and_invalid_samples_say_nothing) {
  Direct scene;
  scene.store(0);
  TreePhotograph photograph = scene.photograph([](std::size_t t) { return t % 2 == 0 ? 1.0F : 0.0F; }, 0);
  for (float& v : photograph.mean) v += 1;  // dark pixels see light from elsewhere
  for (std::size_t t = 0; t < kPixels; t += 4) photograph.valid[t] = 0;
  scene.refine({std::move(photograph)}, {{1e-6}, {0}});
  for (std::size_t t = 0; t < kPixels; ++t) {
    const bool speaks = t % 4 == 2;
    ASSERT_NEAR(scene.error(t), speaks ? 1 : 0, speaks ? 3 * 0x1p-23 : 0) << t;
  }
}

TEST(DirectLight, missed_light_of_a_flood_lit_photograph_is_not_taken_for_direct) {
  // A photograph with a sixteenth of the pixels lit and a flood-lit one, which misses m more than the model
  // knows, m² = 4 · half: it weighs least / (least + m²) of the other, so it moves an entry by that share of
  // m.
  constexpr double kMissed = 0.1, kLeast = 1e-6;
  Direct scene;
  scene.store(0);
  TreePhotograph sparse = scene.photograph([](std::size_t t) { return t % 16 == 0 ? 1.0F : 0.0F; }, 0);
  TreePhotograph flood = scene.photograph(everything, 0);
  for (float& v : flood.mean) v += static_cast<float>(kMissed);
  scene.refine({std::move(sparse), std::move(flood)}, {{kLeast}, {kMissed * kMissed / 4}});
  const double sparse_variance = kLeast + 4.0 / 256 * kMissed * kMissed / 4;
  const double flood_variance = kLeast + kMissed * kMissed;
  const double expected = kMissed * sparse_variance / (sparse_variance + flood_variance);
  EXPECT_LT(expected, 0.01 * kMissed);
  for (std::size_t t = 0; t < kPixels; t += 16) ASSERT_NEAR(scene.error(t), expected, 4 * 0x1p-24) << t;
}

}  // namespace

}  // namespace symrig::acquisition::direct_light_test

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
