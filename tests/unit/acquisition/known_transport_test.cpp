// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/known_transport.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace symrig::acquisition::known_transport_test {
namespace {

constexpr int kChannels = 3;
constexpr Grid kGrid{9, 7};
constexpr std::size_t kPixels = 63;

float signed_value(Random& random) {
  return static_cast<float>(2 * random.uniform() - 1);
}

std::vector<float> signed_values(Random& random, std::size_t n) {
  std::vector<float> values(n);
  for (float& v : values) v = signed_value(random);
  return values;
}

/// T as dense matrices in double, filled by the definition.
class Oracle {
 public:
  void add(std::size_t channel, std::int32_t row, std::int32_t col, double value) {
    at(t_, channel, row, col) += value;
    at(size_, channel, row, col) += std::abs(value);
  }
  double image(const TreePhotograph& p, std::size_t channel, std::int32_t row) const {
    return sum(t_, p, channel, row);
  }
  /// Σ_leaf |A| |B|' |p|, the scale of rounding.
  double magnitude(const TreePhotograph& p, std::size_t channel, std::int32_t row) const {
    return sum(size_, p, channel, row);
  }

 private:
  using Matrix = std::vector<double>;
  static std::size_t index(std::size_t channel, std::int32_t row, std::int32_t col) {
    return (channel * kPixels + static_cast<std::size_t>(row)) * kPixels + static_cast<std::size_t>(col);
  }
  static double& at(Matrix& m, std::size_t channel, std::int32_t row, std::int32_t col) {
    return m[index(channel, row, col)];
  }
  double sum(const Matrix& m, const TreePhotograph& p, std::size_t channel, std::int32_t row) const {
    double total = 0;
    for (std::size_t j = 0; j < kPixels; ++j) {
      const double term =
          m[index(channel, row, static_cast<std::int32_t>(j))] * static_cast<double>(p.pattern[j]);
      total += &m == &size_ ? std::abs(term) : term;
    }
    return total;
  }

  Matrix t_ = Matrix(kChannels * kPixels * kPixels), size_ = t_;
};

/// Known transport and its oracle, told the same.
class Both {
 public:
  Both() : known(tree, kChannels) {}

  std::int32_t leaf(int level, const Block& i, const Block& j, Random& random, bool into_oracle = true) {
    std::vector<float> factors;
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
      const auto a = signed_values(random, static_cast<std::size_t>(i.size()));
      const auto b = &i == &j ? a : signed_values(random, static_cast<std::size_t>(j.size()));
      factors.insert(factors.end(), a.begin(), a.end());
      factors.insert(factors.end(), b.begin(), b.end());
      if (into_oracle) add(channel, i, j, a, b);
    }
    return known.add_leaf(i.begin, i.end, j.begin, j.end, level, factors);
  }
  void scalar(std::int32_t row, std::int32_t col, Random& random) {
    const auto values = signed_values(random, kChannels);
    known.add_scalar(row, col, values);
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
      oracle.add(channel, row, col, static_cast<double>(values[channel]));
      // NOLINTNEXTLINE(readability-suspicious-call-argument): the entry on the other side of the diagonal
      if (row != col) oracle.add(channel, col, row, static_cast<double>(values[channel]));
    }
  }
  /// Every pair of blocks of level 1 and some of level 2, some of them blocks with themselves, and scalars.
  void fill(Random& random) {
    for (int level = 1; level <= 2; ++level) {
      const auto blocks = tree.level(level);
      for (std::size_t i = 0; i < blocks.size(); ++i)
        for (std::size_t j = 0; j <= i; j += static_cast<std::size_t>(level))
          leaf(level, blocks[i], blocks[j], random);
    }
    for (std::int32_t k = 0; k < 60; ++k) scalar(k, (k * 5) % 63, random);
  }

  BlockTree tree{kGrid};
  KnownTransport known;
  Oracle oracle;

 private:
  void add(std::size_t channel, const Block& i, const Block& j, const std::vector<float>& a,
           const std::vector<float>& b) {
    for (std::int32_t x = 0; x < i.size(); ++x)
      for (std::int32_t y = 0; y < j.size(); ++y) {
        const double value = static_cast<double>(a[x]) * static_cast<double>(b[y]);
        oracle.add(channel, i.begin + x, j.begin + y, value);
        if (&i != &j) oracle.add(channel, j.begin + y, i.begin + x, value);
      }
  }
};

/// Photographs of ranges that are lit in part, so that leaves are dark in some batches and lit in others.
std::vector<TreePhotograph> photographs(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<TreePhotograph> all(count);
  for (TreePhotograph& p : all) {
    const auto begin = random.bits() % kPixels;
    const auto end = begin + random.bits() % (kPixels - begin + 1);
    p.pattern.assign(kPixels, 0);
    for (std::size_t t = begin; t < end; ++t) p.pattern[t] = static_cast<float>(random.uniform());
    p.mean = signed_values(random, kChannels * kPixels);
    p.variance.assign(kChannels * kPixels, 0.25F);
    p.valid.assign(kChannels * kPixels, 1);
  }
  return all;
}

std::vector<PagedVector<float>> left_by(const KnownTransport& known, std::vector<TreePhotograph> all) {
  known.subtract_from(all);
  std::vector<PagedVector<float>> means;
  means.reserve(all.size());
  for (TreePhotograph& p : all) means.push_back(std::move(p.mean));
  return means;
}

TEST(KnownTransport, subtracts_what_a_dense_matrix_says) {
  Random random(3);
  Both both;
  both.fill(random);
  // TransportTensor::apply: (|J| + leaves on the path + 4) ε of the magnitude; here no block has more than 20
  // pixels, and a pixel is on at most 4 + 16 leaves and, row and column of them, 60 scalars. Then one
  // subtraction.
  constexpr double kEpsilon = 0x1p-24;
  constexpr double kSums = 20 + 80 + 4;
  for (const std::size_t count : {1U, 2U, 15U, 16U, 17U, 31U, 32U, 33U, 40U}) {
    const auto before = photographs(count, count);
    const auto left = left_by(both.known, before);
    ASSERT_EQ(left.size(), count);
    for (std::size_t k = 0; k < count; ++k)
      for (std::size_t channel = 0; channel < kChannels; ++channel)
        for (std::int32_t i = 0; i < std::int32_t{kPixels}; ++i) {
          const std::size_t at = channel * kPixels + static_cast<std::size_t>(i);
          const double mean = before[k].mean[at];
          const double magnitude = both.oracle.magnitude(before[k], channel, i);
          ASSERT_NEAR(left[k][at], mean - both.oracle.image(before[k], channel, i),
                      kEpsilon * (kSums * magnitude + std::abs(mean) + magnitude))
              << count << " photographs, number " << k << ", channel " << channel << ", pixel " << i;
        }
  }
}

TEST(KnownTransport, patterns_that_are_lit_or_dark_are_no_special_case) {
  Random random(7);
  Both both;
  both.fill(random);
  auto before = photographs(20, 6);
  for (TreePhotograph& p : before)
    for (float& lit : p.pattern) lit = lit > 0.5F ? 1 : 0;
  auto grey = before;
  grey[3].pattern[11] = 0.5F;  // sends the whole batch the other way
  const auto left = left_by(both.known, before);
  const auto left_grey = left_by(both.known, grey);
  constexpr double kEpsilon = 0x1p-24;
  constexpr double kSums = 20 + 80 + 4;
  for (std::size_t k = 0; k < before.size(); ++k)
    for (std::size_t channel = 0; channel < kChannels; ++channel)
      for (std::int32_t i = 0; i < std::int32_t{kPixels}; ++i) {
        const std::size_t at = channel * kPixels + static_cast<std::size_t>(i);
        const double size = both.oracle.magnitude(before[k], channel, i);
        const double mean = before[k].mean[at];
        ASSERT_NEAR(left[k][at], mean - both.oracle.image(before[k], channel, i),
                    kEpsilon * (kSums * size + std::abs(mean) + size));
        ASSERT_NEAR(left_grey[k][at], mean - both.oracle.image(grey[k], channel, i),
                    kEpsilon * (kSums * both.oracle.magnitude(grey[k], channel, i) + std::abs(mean) + size));
      }
}

/// The ranges of a pattern that is lit or dark.
LitBlocks blocks_of(const TreePhotograph& photograph) {
  LitBlocks blocks;
  for (std::int32_t t = 0; t < std::int32_t{kPixels}; ++t) {
    if (photograph.pattern[t] == 0) continue;
    if (blocks.empty() || blocks.back().end != t) blocks.push_back({t, t});
    blocks.back().end = t + 1;
  }
  return blocks;
}

TEST(KnownTransport, needs_no_image_of_patterns_of_blocks) {
  Random random(11);
  Both both;
  both.fill(random);
  both.known.remove_leaf(both.leaf(1, both.tree.level(1)[0], both.tree.level(1)[1], random, false));
  auto before = photographs(20, 12);
  std::vector<LitBlocks> patterns;
  std::vector<PagedVector<float>> left;
  for (TreePhotograph& p : before) {
    for (float& lit : p.pattern) lit = lit > 0.3F ? 1 : 0;
    patterns.push_back(blocks_of(p));
    std::ranges::reverse(patterns.back());  // in any order
    left.push_back(p.mean);
  }
  const std::vector<std::span<float>> means(left.begin(), left.end());
  both.known.subtract_lit(patterns, means);
  // Each of the 80 leaves and 60 scalars of a pixel rounds what is left then; a leaf's sum has 20 pixels.
  constexpr double kEpsilon = 0x1p-24;
  constexpr double kSums = 20 + 80 + 60 + 2;
  for (std::size_t k = 0; k < before.size(); ++k)
    for (std::size_t channel = 0; channel < kChannels; ++channel)
      for (std::int32_t i = 0; i < std::int32_t{kPixels}; ++i) {
        const std::size_t at = channel * kPixels + static_cast<std::size_t>(i);
        const double mean = before[k].mean[at];
        ASSERT_NEAR(left[k][at], mean - both.oracle.image(before[k], channel, i),
                    kEpsilon * kSums * (both.oracle.magnitude(before[k], channel, i) + std::abs(mean)));
      }
  // One of them alone has the same bits.
  PagedVector<float> alone = before[7].mean;
  const std::vector<std::span<float>> one{std::span<float>(alone)};
  both.known.subtract_lit(std::span(patterns).subspan(7, 1), one);
  EXPECT_EQ(alone, left[7]);
}

// Half a million pixels: few photographs go another way than many. Nine of them are many.
TEST(KnownTransport, few_large_photographs_lose_the_same_light_as_many) {
  constexpr Grid kLarge{1024, 512};
  constexpr auto kAll = static_cast<std::size_t>(kLarge.size());
  constexpr std::size_t kCount = 9;
  Random random(17);
  const BlockTree tree(kLarge);
  KnownTransport known(tree, 2);
  const auto blocks = tree.level(5);
  std::vector<std::int32_t> leaves_of(kAll), scalars_of(kAll);
  const auto add_some = [&](int count) {
    for (int k = 0; k < count; ++k) {
      const Block& i = blocks[random.bits() % blocks.size()];
      const Block& j = blocks[random.bits() % blocks.size()];
      known.add_leaf(i.begin, i.end, j.begin, j.end, 5,
                     signed_values(random, 2 * static_cast<std::size_t>(i.size() + j.size())));
      for (std::int32_t t = i.begin; t < i.end; ++t) ++leaves_of[t];
      for (std::int32_t t = j.begin; t < j.end; ++t) ++leaves_of[t];
      const auto row = static_cast<std::int32_t>(random.bits() % kAll);
      known.add_scalar(row, j.begin, signed_values(random, 2));
    }
  };
  add_some(300);
  known.remove_leaf(7);
  const KnownTransport::Mark mark = known.mark();
  add_some(40);
  std::vector<TreePhotograph> many(kCount);
  for (TreePhotograph& p : many) {
    p.pattern.assign(kAll, 0);
    for (float& lit : p.pattern) lit = static_cast<float>(random.uniform());
    p.mean = signed_values(random, 2 * kAll);
  }
  std::vector<TreePhotograph> few(many.begin(), many.begin() + 2), since = few;
  std::vector<TreePhotograph> many_since = many;
  known.subtract_from(many);
  known.subtract_from(few);
  known.subtract_from(many_since, mark);
  known.subtract_from(since, mark);
  // Both round sums of 512 pixels, and each leaf and scalar of a pixel what is left: at most 40 here. A leaf
  // gives at most Σ|b| p ≤ 512 times |a| ≤ 1.
  constexpr double kEpsilon = 0x1p-24;
  const auto most = *std::max_element(leaves_of.begin(), leaves_of.end());
  ASSERT_LE(most, 40);
  const double bound = 2 * kEpsilon * (512 + 2 * 40) * (1 + 512.0 * most + 40);
  for (std::size_t k = 0; k < few.size(); ++k)
    for (std::size_t at = 0; at < 2 * kAll; ++at) {
      ASSERT_NEAR(few[k].mean[at], many[k].mean[at], bound);
      ASSERT_NEAR(since[k].mean[at], many_since[k].mean[at], bound);
    }
  EXPECT_NE(few[0].mean, since[0].mean);
}

TEST(LitPixels, are_those_of_the_blocks) {
  Random random(13);
  for (const std::size_t pixels : {1U, 63U, 64U, 65U, 200U, 1000U}) {
    std::vector<char> lit(pixels);
    LitBlocks blocks;
    for (std::int32_t begin = 0; begin < static_cast<std::int32_t>(pixels);) {
      const auto end = std::min<std::int32_t>(static_cast<std::int32_t>(pixels),
                                              begin + 1 + static_cast<int>(random.bits() % 90));
      if (random.bits() % 2 == 0) {
        blocks.push_back({begin, end});
        std::fill(lit.begin() + begin, lit.begin() + end, 1);
      }
      begin = end;
    }
    std::ranges::reverse(blocks);
    const LitPixels found(blocks, pixels);
    const std::vector<float> ones(pixels, 1);
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(pixels); ++t) EXPECT_EQ(found[t], lit[t] != 0);
    for (int k = 0; k < 200; ++k) {
      const auto begin = static_cast<std::int32_t>(random.bits() % pixels);
      const auto end = begin + static_cast<std::int32_t>(random.bits() % (pixels - begin + 1));
      const auto count = std::count(lit.begin() + begin, lit.begin() + end, 1);
      EXPECT_EQ(found.any(begin, end), count > 0);
      EXPECT_EQ(found.sum(begin, std::span(ones).first(end - begin)), static_cast<float>(count));
    }
  }
}

TEST(KnownTransport, subtracts_the_same_bits_with_any_number_of_threads) {
  Random random(4);
  Both both;
  both.fill(random);
  const auto before = photographs(40, 9);
  std::vector<std::vector<PagedVector<float>>> answers;
  for (std::size_t threads = 1; threads <= 4; ++threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    answers.push_back(left_by(both.known, before));
  }
  for (const auto& answer : answers) EXPECT_EQ(answer, answers[0]);
}

TEST(KnownTransport, only_the_mean_of_a_photograph_changes) {
  Random random(5);
  Both both;
  both.fill(random);
  const auto before = photographs(3, 2);
  auto after = before;
  both.known.subtract_from(after);
  for (std::size_t k = 0; k < before.size(); ++k) {
    EXPECT_EQ(after[k].pattern, before[k].pattern);
    EXPECT_EQ(after[k].variance, before[k].variance);
    EXPECT_EQ(after[k].valid, before[k].valid);
  }
}

TEST(KnownTransport, subtracting_what_came_since_a_mark_completes_what_went_before) {
  Random random(8);
  Both both;
  both.fill(random);
  const auto before = photographs(20, 3);
  auto in_steps = before;
  both.known.subtract_from(in_steps);
  const KnownTransport::Mark mark = both.known.mark();
  const std::int64_t rewritten = both.known.rewritten();
  both.fill(random);
  EXPECT_EQ(both.known.rewritten(), rewritten) << "adding changes nothing that was there";
  both.known.subtract_from(in_steps, mark);
  const auto at_once = left_by(both.known, before);
  // As above, with twice the leaves, and once more for the step between.
  constexpr double kEpsilon = 0x1p-24;
  constexpr double kSums = 20 + 2 * 80 + 8;
  for (std::size_t k = 0; k < before.size(); ++k)
    for (std::size_t channel = 0; channel < kChannels; ++channel)
      for (std::int32_t i = 0; i < std::int32_t{kPixels}; ++i) {
        const std::size_t at = channel * kPixels + static_cast<std::size_t>(i);
        const double size =
            both.oracle.magnitude(before[k], channel, i) + std::abs(static_cast<double>(before[k].mean[at]));
        ASSERT_NEAR(in_steps[k].mean[at], at_once[k][at], 2 * kEpsilon * kSums * size);
      }
  both.known.remove_leaf(0);
  EXPECT_GT(both.known.rewritten(), rewritten);
}

TEST(KnownTransport, rewind_forgets_what_came_after_the_mark) {
  Random random(6);
  Both both;
  both.fill(random);
  const auto p = photographs(5, 1);
  const auto left = left_by(both.known, p);
  const auto empties = both.known.tensor().empties(1).size();
  const KnownTransport::Mark mark = both.known.mark();
  const auto blocks = both.tree.level(1);
  both.leaf(1, blocks[2], blocks[0], random);
  both.scalar(3, 3, random);
  both.known.add_empty(1, 3, 0);
  ASSERT_NE(left_by(both.known, p), left);
  ASSERT_EQ(both.known.tensor().empties(1).size(), empties + 1);
  both.known.rewind(mark);
  EXPECT_EQ(left_by(both.known, p), left);
  EXPECT_EQ(both.known.tensor().empties(1).size(), empties);
  // What is added next takes the place of what was forgotten.
  Random once(8), again(8);
  both.leaf(1, blocks[2], blocks[0], once);
  const auto first = left_by(both.known, p);
  both.known.rewind(mark);
  both.leaf(1, blocks[2], blocks[0], again);
  EXPECT_EQ(left_by(both.known, p), first);
}

TEST(KnownTransport, a_removed_leaf_neither_shines_nor_is_stored) {
  Random with(7), without(7);
  Both both, never;
  const auto blocks = both.tree.level(1);
  const auto same = never.tree.level(1);
  both.fill(with);
  never.fill(without);
  const std::int32_t leaf = both.leaf(1, blocks[3], blocks[1], with);
  never.leaf(1, same[3], same[1], without);  // the same numbers are drawn
  const std::int32_t kept = both.leaf(1, blocks[2], blocks[0], with);
  const auto p = photographs(5, 1);
  both.known.remove_leaf(leaf);
  EXPECT_TRUE(both.known.leaves()[leaf].removed);
  EXPECT_FALSE(both.known.leaves()[kept].removed);
  never.known.rewind({never.known.leaves().size() - 1,
                      static_cast<std::size_t>(never.known.leaves().back().factors),
                      never.known.mark().empties, never.known.scalars().size()});
  never.leaf(1, same[2], same[0], without);
  EXPECT_EQ(left_by(both.known, p), left_by(never.known, p));
  const TransportTensor with_both = both.known.tensor(), with_one = never.known.tensor();
  EXPECT_EQ(with_both.leaves().size(), with_one.leaves().size());
}

}  // namespace
}  // namespace symrig::acquisition::known_transport_test
