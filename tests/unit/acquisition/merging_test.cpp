// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/merging.hpp"

#include "dense_scene.hpp"
#include "workbench.hpp"

#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace symrig::acquisition::merging_test {
namespace {

using tests::default_options;
using tests::DenseProbe;
using tests::DenseTransport;
using tests::Gaussian;
using tests::Workbench;

/// Blocks of level 1 have 64 pixels, of level 2 16, of level 3 4.
constexpr Grid kGrid{16, 16};
constexpr int kPixels = 256;
constexpr std::int32_t kParent = 64, kChild = 16;

/// Known leaves between the second block of level 1 and the first, or below the first alone.
class Merging : public testing::Test {
 protected:
  explicit Merging(int channels = 1)
      : scene_(kGrid, [](int i, int j) { return i == j ? 1.0 : 0.0; }),
        probe_(scene_),
        bench_(probe_),
        channels_(channels),
        known_(bench_.tree, channels),
        facts_{bench_.options, bench_.tree, channels, std::vector<double>(channels, 1.0)} {
    bench_.options = *settings_of({});
  }

  using Factor = std::function<double(int channel, std::int32_t pixel)>;
  std::int32_t add(std::int32_t row, std::int32_t col, std::int32_t size, int level, const Factor& a,
                   const Factor& b) {
    std::vector<float> factors;
    for (int channel = 0; channel < channels_; ++channel) {
      for (std::int32_t t = row; t < row + size; ++t) factors.push_back(static_cast<float>(a(channel, t)));
      for (std::int32_t t = col; t < col + size; ++t) factors.push_back(static_cast<float>(b(channel, t)));
    }
    return known_.add_leaf(row, row + size, col, col + size, level, factors);
  }

  /// The sixteen child pairs (a, b) as leaves strength(channel, a, b) u v'.
  using Strength = std::function<double(int channel, int a, int b)>;
  void add_children(const Strength& strength, const Factor& u, const Factor& v) {
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        add(
            kParent + a * kChild, b * kChild, kChild, 2,
            [&](int channel, std::int32_t t) { return strength(channel, a, b) * u(channel, t); }, v);
  }

  /// T 1_j for each pixel j of the first block, seen everywhere.
  std::vector<TreePhotograph> columns() const {
    std::vector<TreePhotograph> photographs;
    const std::vector<float> dark(static_cast<std::size_t>(channels_) * kPixels);
    for (std::size_t j = 0; j < kParent; ++j) {
      photographs.push_back({std::vector<float>(kPixels), dark, {}, {}});
      photographs.back().pattern[j] = 1;
    }
    known_.subtract_from(photographs);
    return photographs;
  }
  /// |T_now − T_before|.
  static double distance(const std::vector<TreePhotograph>& now, const std::vector<TreePhotograph>& before) {
    double squares = 0;
    for (std::size_t j = 0; j < now.size(); ++j)
      for (std::size_t t = 0; t < now[j].mean.size(); ++t)
        squares += std::pow(static_cast<double>(now[j].mean[t]) - before[j].mean[t], 2);
    return std::sqrt(squares);
  }
  std::vector<int> ranks() const {
    const TransportTensor tensor = known_.tensor();
    std::vector<int> ranks;
    for (const Leaf& leaf : tensor.leaves()) ranks.push_back(leaf.rank);
    return ranks;
  }

  static double smooth(int channel, std::int32_t t) { return 0.02 * (1 + channel + std::cos(0.1 * t)); }

  DenseTransport scene_;
  DenseProbe probe_;
  Workbench bench_;
  int channels_;
  KnownTransport known_;
  SearchFacts facts_;
};

// Factors are sums of at most 16 products in float or double: 64 ε bounds what is rounded of |T| = 1 or less.
constexpr double kRounding = 64.0 / (1 << 24);

class ExactRank : public Merging, public testing::WithParamInterface<int> {};

TEST_P(ExactRank, becomes_one_leaf_and_keeps_the_transport) {
  const int rank = GetParam();
  // A 4 × 4 table with singular values of about 3 and 1: rows repeat but for `rank` of them.
  add_children([&](int, int a, int b) { return a < rank && a == b ? 3.0 : 1.0; }, smooth, smooth);
  const auto before = columns();
  merge_leaves(facts_, known_);
  // The table has the rows (3 1 1 1), (1 3 1 1), …, and (1 1 1 1) where they end.
  EXPECT_EQ(ranks(), std::vector<int>{rank + 1});
  EXPECT_LE(distance(columns(), before), kRounding);
}
INSTANTIATE_TEST_SUITE_P(Ranks, ExactRank, testing::Values(0, 1, 2));

TEST_F(Merging, leaves_what_has_full_rank_alone) {
  // Each pair has factors of its own: two pairs in a row already need rank 2, which takes as much as they do.
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) {
      Random random(static_cast<std::uint64_t>(4 * a + b));
      const Factor noise = [&](int, std::int32_t) { return random.uniform(); };
      add(kParent + a * kChild, b * kChild, kChild, 2, noise, noise);
    }
  merge_leaves(facts_, known_);
  EXPECT_EQ(ranks(), std::vector<int>(16, 1));
}

TEST_F(Merging, merges_the_part_of_a_block_that_can_be) {
  // The first two rows of pairs are smooth, the others have factors of their own.
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) {
      Random random(static_cast<std::uint64_t>(4 * a + b));
      const Factor noise = [&](int, std::int32_t) { return random.uniform(); };
      add(kParent + a * kChild, b * kChild, kChild, 2, a < 2 ? Factor(smooth) : noise,
          a < 2 ? Factor(smooth) : noise);
    }
  const auto before = columns();
  merge_leaves(facts_, known_);
  std::vector<int> expected(9, 1);
  EXPECT_EQ(ranks(), expected);
  EXPECT_LE(distance(columns(), before), kRounding);
  const TransportTensor tensor = known_.tensor();
  const Leaf& leaf = tensor.leaves().back();
  EXPECT_EQ(leaf.row_begin, kParent);
  EXPECT_EQ(leaf.row_end, kParent + 2 * kChild);
  EXPECT_EQ(leaf.col_begin, 0);
  EXPECT_EQ(leaf.col_end, kParent);
  EXPECT_EQ(leaf.level, 2);
}

TEST_F(Merging, does_not_lose_what_cancels_in_the_photographs_of_the_children) {
  // In one child pair, four by four leaves of a chequered block: 1 ± 0.5, which sums to 1 over every child.
  const auto sign = [](std::int32_t t) { return t / 4 % 2 == 0 ? 0.5 : -0.5; };
  const auto one = [](int, std::int32_t) { return 0.1; };
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) {
      if (a != 0 || b != 0) {
        add(kParent + a * kChild, b * kChild, kChild, 2, one, one);
        continue;
      }
      for (std::int32_t i = kParent; i < kParent + kChild; i += 4)
        for (std::int32_t j = 0; j < kChild; j += 4)
          add(
              i, j, 4, 3, [&](int, std::int32_t) { return 0.1 * (1 + sign(i) * sign(j)); }, one);
    }
  const auto before = columns();
  merge_leaves(facts_, known_);
  EXPECT_EQ(ranks(), std::vector<int>{2});
  EXPECT_LE(distance(columns(), before), kRounding);
}

TEST_F(Merging, spends_a_rank_on_what_misses_the_photographs_of_the_children_by_a_fifth_of_the_tolerance) {
  // T = f f (1 ± δ), constant in each pair: rank 1 loses ± f f δ, 16 of them in each photograph of a child.
  // The random pattern alone would allow twice as much.
  const Factor flat = [](int, std::int32_t) { return 0.16; };
  for (const double share : {0.15, 0.25}) {
    known_.rewind({});
    const double delta = share * facts_.options.rule.flood_fraction / (kChild * 0.16 * 0.16);
    add_children([&](int, int a, int b) { return 1 + ((a + b) % 2 == 0 ? delta : -delta); }, flat, flat);
    merge_leaves(facts_, known_);
    EXPECT_EQ(ranks(), std::vector<int>{share < 0.2 ? 1 : 2});
  }
}

TEST_F(Merging, spends_no_rank_on_noise_and_takes_some_of_it_out) {
  constexpr double kSigma = 0.004;  // of the images c and r, 1 % of them and 13 τ_A F
  constexpr auto kVariance = static_cast<float>(kSigma * kSigma);
  constexpr double kSum = kChild * 0.16;
  for (const bool told : {true, false}) {
    known_.rewind({});
    const Factor flat = [](int, std::int32_t) { return 0.16; };
    add_children([](int, int, int) { return 1.0; }, flat, flat);
    const auto exact = columns();
    Gaussian gaussian(3);
    for (float& x : known_.change_factors()) x += static_cast<float>(kSigma / kSum * gaussian());
    for (std::int32_t leaf = 0; told && leaf < 16; ++leaf) known_.set_noise(leaf, kVariance, kVariance);
    const double noise = distance(columns(), exact);
    merge_leaves(facts_, known_);
    if (told) {
      // Of four children's noise one direction in four is kept on either side.
      EXPECT_EQ(ranks(), std::vector<int>{1});
      EXPECT_LT(distance(columns(), exact), 0.7 * noise);
    } else {
      EXPECT_GT(ranks().size(), 1U);  // for all it knows, the leaves differ
    }
  }
}

TEST_F(Merging, stays_clear_of_the_diagonal) {
  // Below the first block: the pairs (a, b), a > b, of its children.
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < a; ++b) add(a * kChild, b * kChild, kChild, 2, smooth, smooth);
  const auto before = columns();
  merge_leaves(facts_, known_);
  // Four of the six are a square, (1, 0) and (3, 2) are left.
  EXPECT_EQ(ranks(), (std::vector<int>{1, 1, 1}));
  const TransportTensor tensor = known_.tensor();
  for (const Leaf& leaf : tensor.leaves()) EXPECT_GE(leaf.row_begin, leaf.col_end);
  EXPECT_LE(distance(columns(), before), kRounding);
}

TEST_F(Merging, is_off_at_rank_one) {
  bench_.options.economy.rank = 1;
  add_children([](int, int, int) { return 1.0; }, smooth, smooth);
  merge_leaves(facts_, known_);
  EXPECT_EQ(ranks(), std::vector<int>(16, 1));
}

TEST_F(Merging, does_not_touch_leaves_that_were_taken_back) {
  add_children([](int, int, int) { return 1.0; }, smooth, smooth);
  known_.remove_leaf(5);
  const auto before = columns();
  merge_leaves(facts_, known_);
  EXPECT_LE(distance(columns(), before), kRounding);
}

class MergingColours : public Merging {
 protected:
  MergingColours() : Merging(3) {}
};

TEST_F(MergingColours, share_the_rank_of_the_one_that_needs_most) {
  // Red has rank 1, green 2, and there is no blue: a leaf has one index, hence one rank, for all channels.
  add_children(
      [](int channel, int a, int b) {
        return channel == 2 ? 0.0 : channel == 1 && a == 1 && b == 2 ? 3.0 : 1.0;
      },
      smooth, smooth);
  facts_.flood_squared[2] = 0;
  const auto before = columns();
  merge_leaves(facts_, known_);
  EXPECT_EQ(ranks(), std::vector<int>{2});
  EXPECT_LE(distance(columns(), before), kRounding);
}

TEST_F(Merging, gives_the_same_bits_for_any_number_of_threads) {
  std::vector<std::vector<float>> factors;
  for (const std::size_t threads : {std::size_t{1}, std::size_t{3}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    known_.rewind({});
    add_children([](int, int a, int b) { return a == b ? 2.0 : 1.0; }, smooth, smooth);
    merge_leaves(facts_, known_);
    factors.emplace_back(known_.factors().begin(), known_.factors().end());
  }
  EXPECT_EQ(factors[0], factors[1]);
}

/// Light between two curved surfaces, smooth but of no low rank.
double curved(int i, int j) {
  const int x = i / 32 - j / 32, y = i % 32 - j % 32;
  return i == j ? 1 : 0.02 / (2 + x * x + y * y);
}

TEST(MergingOfACapture, takes_fewer_bytes_for_the_same_photographs_and_nearly_the_same_error) {
  const DenseTransport scene(Grid{32, 32}, curved);
  std::vector<CaptureResult> results;
  std::vector<TransportErrors> errors;
  for (const int rank : {1, 3}) {
    DenseProbe probe(scene);
    CaptureOptions options = default_options();
    options.economy->rank = rank;
    auto result = capture(probe, options);
    ASSERT_TRUE(result.ok());
    const auto error = evaluate(result->tensor, scene.truth());
    ASSERT_TRUE(error.ok());
    errors.push_back(*error);
    results.push_back(*std::move(result));
  }
  EXPECT_EQ(results[0].patterns, results[1].patterns);
  EXPECT_LT(results[1].tensor.bytes(), results[0].tensor.bytes());
  // Each merge adds at most 2 % to the misfit that its leaves may have; those of three levels can add up.
  EXPECT_LE(errors[1].indirect, 1.06 * errors[0].indirect);
  EXPECT_LE(errors[1].frobenius, 1.06 * errors[0].frobenius);
}

}  // namespace
}  // namespace symrig::acquisition::merging_test
