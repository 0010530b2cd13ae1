// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/node.hpp"

#include "acquisition/tree/rank_test.hpp"
#include "dense_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::node_test {
namespace {

/// A node between two blocks of a quarter of the grid each. Its images are ±1 in each child.
class SignedNode : public testing::TestWithParam<int> {
 protected:
  static constexpr double kUnpredictable = std::numeric_limits<double>::infinity();

  SignedNode() : tree_(Grid{GetParam(), GetParam()}), level_(tree_, 1, 1) {}

  std::vector<float> image(std::int32_t block, unsigned signs) const {
    const Block& of = level_.block(block);
    std::vector<float> values(of.size());
    for (int k = 0; k < of.children; ++k) {
      const Block& child = level_.child(of, k);
      std::fill(values.begin() + (child.begin - of.begin), values.begin() + (child.end - of.begin),
                (signs >> static_cast<unsigned>(k) & 1U) != 0 ? 1.0F : -1.0F);
    }
    return values;
  }

  void add(std::span<const float> c, std::span<const float> r) {
    const std::vector<PairNoise> none{{0, 0}};
    level_.add(1, 0, c, r, none, none, kUnpredictable);
  }

  /// The brightest pixel, with any sign, that the estimate foresees while a child is lit.
  float brightest(const Node& node) const {
    float most = 0;
    for (const auto side : {NodeLevel::Side::row, NodeLevel::Side::col})
      for (int slot = 0; slot < 4; ++slot) {
        std::vector<float> light(tree_.order().size());
        level_.add_estimate(node, side, slot, 0, light);
        for (const float v : light) most = std::max(most, std::abs(v));
      }
    return most;
  }

  BlockTree tree_;
  NodeLevel level_;
};

TEST_P(SignedNode, no_child_shows_more_than_twice_the_light_of_the_block) {
  // What errors of other leaves leave behind has both signs. A child's share is |Σ over the child| / s, and s
  // is at least half of the sum of these over all children. So no share is above 2, however large the block.
  // The plain sum of a block would be 0 here for 36 of the 256 nodes on both sides.
  for (unsigned row = 0; row < 16; ++row)
    for (unsigned col = 0; col < 16; ++col) add(image(1, row), image(0, col));
  for (const Node& node : level_.nodes()) EXPECT_LE(brightest(node), 2);
}

TEST_P(SignedNode, light_without_sign_has_its_plain_sum) {
  std::vector<float> c(level_.block(1).size());
  std::vector<float> r(level_.block(0).size());
  std::mt19937 random(1);
  std::uniform_real_distribution<float> light(0.5F, 1.5F);
  double sum = 0;
  for (std::vector<float>* image : {&c, &r})
    for (float& v : *image) sum += static_cast<double>(v = light(random));
  add(c, r);
  // Sums in double precision, in another order.
  EXPECT_NEAR(level_.sums(level_.nodes()[0], 0).s, sum / 2, sum * 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Grids, SignedNode, testing::Values(8, 32, 128));

}  // namespace

}  // namespace symrig::acquisition::node_test

namespace symrig::acquisition::rank_test_test {
namespace {

using tests::DenseTransport;

/// A pair of blocks of a 4 × 8 grid (its left and right half), photographed from both sides.
class TwoHalves : public testing::Test {
 protected:
  static constexpr Grid kGrid{4, 8};
  // 4 × 8 → level 1: four blocks of 2 × 4. The node (1, 0) is the pair top right × top left.
  TwoHalves() : tree_(kGrid), level_(tree_, 1, 1) {}

  std::vector<float> photograph(const DenseTransport& t, const Block& lit) const {
    Image<float> pattern(kGrid);
    std::vector<float> tree_pattern(32), answer(32);
    std::fill(tree_pattern.begin() + lit.begin, tree_pattern.begin() + lit.end, 1.0F);
    tree_.to_raster(tree_pattern, pattern.plane(0));
    const Image<float> seen = t.apply(pattern);
    tree_.to_tree(seen.plane(0), answer);
    return answer;
  }

  const Node& measure(const DenseTransport& t) {
    const Block& i = level_.block(1);
    const Block& j = level_.block(0);
    const auto c = photograph(t, j);
    const auto r = photograph(t, i);
    const std::vector<PairNoise> noise{{0, 8}};
    level_.add(1, 0, std::span(c).subspan(i.begin, 8), std::span(r).subspan(j.begin, 8), noise, noise,
               std::numeric_limits<double>::infinity());
    const std::int32_t tested[] = {0};
    level_.make_room(tested);
    const std::vector<float> variance(32);
    const std::vector<std::uint8_t> valid(32, 1);
    for (int k = 0; k < 4; ++k) {
      level_.record(level_.nodes()[0], NodeLevel::Side::col, k, photograph(t, level_.child(j, k)), variance,
                    valid);
      level_.record(level_.nodes()[0], NodeLevel::Side::row, k, photograph(t, level_.child(i, k)), variance,
                    valid);
    }
    return level_.nodes()[0];
  }

  /// M between the right (u) and the left (v) half, symmetric as a whole.
  static DenseTransport transport(const std::function<double(int, int)>& m) {
    return {kGrid, [m](int i, int j) {
              const bool right_i = i % 8 >= 4, right_j = j % 8 >= 4;
              if (right_i == right_j) return 0.0;
              return right_i ? m(i, j) : m(j, i);
            }};
  }

  BlockTree tree_;
  NodeLevel level_;
};

TEST_F(TwoHalves, a_rank_one_block_is_recovered_from_its_two_photographs) {
  // The two-image minimum of [Garg06 §5]: c = M 1 and r = M' 1 give M = c r'/s. Every photograph after that
  // only confirms it.
  const auto u = [](int i) { return 0.1 + 0.01 * i; };
  const auto v = [](int j) { return 0.5 / (1 + j); };
  const DenseTransport t = transport([&](int i, int j) { return u(i) * v(j); });
  const Node& node = measure(t);
  const double flood_squared[] = {1.0};
  const Comparison evidence = level_.evidence(node, flood_squared).total();
  EXPECT_GT(evidence.signal, 0);
  // Each sample is a float of at most max(c): half a unit in the last place of each, squared and summed over
  // 64 samples, a few times.
  EXPECT_LE(evidence.misfit, evidence.samples * std::pow(8 * 0x1p-24, 2) * evidence.signal);
  const auto c = level_.c(node, 0);
  const auto r = level_.r(node, 0);
  for (std::size_t x = 0; x < c.size(); ++x)
    for (std::size_t y = 0; y < r.size(); ++y) {
      const int i = tree_.order()[static_cast<std::size_t>(level_.block(1).begin) + x];
      const int j = tree_.order()[static_cast<std::size_t>(level_.block(0).begin) + y];
      EXPECT_NEAR(double{c[x]} * double{r[y]} / level_.sums(node, 0).s, t.at(i, j),
                  16 * 0x1p-24 * t.at(i, j));
    }
}

/// The rank test exactly as printed: render the eight estimates, compare with the eight measurements, one RMS
/// error. [Garg06 §5.2]
double garg06_rms_error(const DenseTransport& t, const BlockTree& tree, const NodeLevel& level,
                        const Node& node) {
  double squares = 0;
  int samples = 0;
  const Block& i = level.block(node.row);
  const Block& j = level.block(node.col);
  const auto entry = [&](std::int32_t a, std::int32_t b) { return t.at(tree.order()[a], tree.order()[b]); };
  double total = 0;
  for (std::int32_t a = i.begin; a < i.end; ++a)
    for (std::int32_t b = j.begin; b < j.end; ++b) total += entry(a, b);
  const auto row_sum = [&](std::int32_t a) {
    double sum = 0;
    for (std::int32_t b = j.begin; b < j.end; ++b) sum += entry(a, b);
    return sum;
  };
  const auto col_sum = [&](std::int32_t b) {
    double sum = 0;
    for (std::int32_t a = i.begin; a < i.end; ++a) sum += entry(a, b);
    return sum;
  };
  for (int k = 0; k < j.children; ++k)
    for (std::int32_t a = i.begin; a < i.end; ++a, ++samples) {
      double measured = 0, estimate = 0;
      for (std::int32_t b = level.child(j, k).begin; b < level.child(j, k).end; ++b) {
        measured += entry(a, b);
        estimate += row_sum(a) * col_sum(b) / total;
      }
      squares += (measured - estimate) * (measured - estimate);
    }
  for (int k = 0; k < i.children; ++k)
    for (std::int32_t b = j.begin; b < j.end; ++b, ++samples) {
      double measured = 0, estimate = 0;
      for (std::int32_t a = level.child(i, k).begin; a < level.child(i, k).end; ++a) {
        measured += entry(a, b);
        estimate += row_sum(a) * col_sum(b) / total;
      }
      squares += (measured - estimate) * (measured - estimate);
    }
  return std::sqrt(squares / samples);
}

TEST_F(TwoHalves, evidence_is_the_rms_error_of_the_paper) {
  const DenseTransport t =
      transport([](int i, int j) { return 0.2 + 0.1 * std::sin(i * 1.7 + j * j * 0.3); });
  const Node& node = measure(t);
  const double flood_squared[] = {1.0};
  const Comparison evidence = level_.evidence(node, flood_squared).total();
  const double printed = garg06_rms_error(t, tree_, level_, node);
  EXPECT_GT(printed, 1e-3);
  EXPECT_NEAR(std::sqrt(evidence.misfit / evidence.samples), printed,
              1e-6);  // floats of size ~1: 64 roundings of 6e-8 at the most
}

TEST_F(TwoHalves, energy_in_one_child_pair_deceives_the_paper_and_not_the_guard) {
  // One child pair holds a permutation: full rank, and yet the estimate meets every child photograph.
  // docs/research/rank-test.md
  const BlockTree& tree = tree_;
  const Block a = level_.child(level_.block(1), 0), b = level_.child(level_.block(0), 0);
  std::vector<int> place(32);
  for (std::size_t k = 0; k < 32; ++k) place[tree.order()[k]] = static_cast<int>(k);
  const DenseTransport t = transport([&](int i, int j) {
    const int x = place[i] - a.begin, y = place[j] - b.begin;
    return x >= 0 && x < a.size() && x == y ? 1.0 : 0.0;
  });
  const double flood_squared[] = {1.0};
  const RankEvidence evidence = level_.evidence(measure(t), flood_squared);
  EXPECT_TRUE(fits_rank1(evidence.total(), default_rule(Algorithm::paper)));
  EXPECT_TRUE(is_leaf(evidence, default_rule(Algorithm::paper)));
  EXPECT_FALSE(is_leaf(evidence, default_rule(Algorithm::symrig)));
}

/// Evidence with this total, the same in each of the 32 comparisons of a child pair.
RankEvidence evenly(const Comparison& total) {
  RankEvidence e;
  for (PairTable* side : {&e.on_row, &e.on_col})
    for (auto& row : *side)
      row.fill({total.misfit / 32, total.signal / 32, total.noise / 32, total.samples / 32});
  return e;
}

TEST(RankTest, noise_alone_passes_and_a_misfit_above_it_does_not) {
  RankRule rule = default_rule(Algorithm::symrig);
  rule.flood_fraction = rule.signal_fraction = 0;
  const double allowed = 2 * (1 + 3 * 0.1);  // V (1 + k √(2/n)), V = 2, n = 200, k = 3, √(2/200) = 0.1
  EXPECT_TRUE(is_leaf(evenly({allowed * 0.999, 32, 2, 200}), rule));
  EXPECT_FALSE(is_leaf(evenly({allowed * 1.001, 32, 2, 200}), rule));
}

TEST(RankTest, each_tolerance_acts_alone) {
  RankRule rule{0, 0, 0, 0, 1};
  const Comparison e{0.04, 50, 0, 100};
  EXPECT_FALSE(fits_rank1(e, rule));
  rule.signal_fraction = 0.03;  // 9e-4 · 50 = 0.045
  EXPECT_TRUE(fits_rank1(e, rule));
  rule.signal_fraction = 0;
  rule.flood_fraction = 0.021;  // 4.41e-4 · 100 = 0.0441
  EXPECT_TRUE(fits_rank1(e, rule));
}

}  // namespace

}  // namespace symrig::acquisition::rank_test_test

namespace symrig::acquisition::prediction_test {
namespace {

constexpr int kLevel = 2;                               // risk 2.5 · 2² = 10 tolerances
constexpr double kSamples = 50;                         // of a child pair, from one side
constexpr double kRowSignal = 0.02, kColSignal = 0.08;  // mean squares: m = √(0.02 · 0.08) = 0.04

const RankRule kRule = default_rule(Algorithm::symrig);  // τ_A = 3e-4, k = 3
const Economy kEconomy = default_economy(Algorithm::symrig);

/// Sixteen child pairs alike, each with a mean square misfit beyond noise of e² and the noise V a side.
RankEvidence alike(double e, double noise = 0) {
  const double allowed = noise_allowance(2 * noise, 2 * kSamples, kRule.noise_sigmas);
  const double misfit = e * e * kSamples + allowed / 2;
  RankEvidence evidence;
  for (auto& row : evidence.on_row) row.fill({misfit, kRowSignal * kSamples + noise, noise, kSamples, noise});
  for (auto& row : evidence.on_col) row.fill({misfit, kColSignal * kSamples + noise, noise, kSamples, noise});
  return evidence;
}

double predicted(const RankEvidence& evidence, int a = 1, int b = 2, int level = kLevel) {
  return undecayed_misfit(evidence, a, b, level, kRule, kEconomy);
}

constexpr double kRounding = 1e-12;  // relative: a dozen double operations

TEST(UndecayedMisfit, is_the_geometric_mean_of_misfit_and_signal) {
  // √(1e-6 · 0.04) = 2e-4
  EXPECT_NEAR(predicted(alike(1e-3)), 2e-4, 2e-4 * kRounding);
}

TEST(UndecayedMisfit, noise_counts_neither_as_misfit_nor_as_signal) {
  // The noise terms cancel but for their rounding: V ≈ 1 against a misfit of 5e-5.
  EXPECT_NEAR(predicted(alike(1e-3, 1.0)), 2e-4, 2e-4 * 1e-10);
  RankEvidence quiet = alike(0, 1.0);
  quiet.on_row[1][2].misfit = quiet.on_col[1][2].misfit = 0;  // below what noise explains
  EXPECT_EQ(predicted(quiet), 0);
}

TEST(UndecayedMisfit, noise_of_the_estimate_is_no_excuse_for_a_weak_signal) {
  // A bright estimate's shot noise makes its misfit uncertain, not the light that was measured.
  RankEvidence evidence = alike(1e-3);
  for (auto* table : {&evidence.on_row, &evidence.on_col})
    for (auto& row : *table)
      for (Comparison& pair : row) pair.noise = 2 * pair.signal;
  evidence.diagonal = true;
  EXPECT_GT(predicted(evidence), kEconomy.diagonal_spread * kEconomy.diagonal_spread * 0.999 * kRowSignal);
}

TEST(UndecayedMisfit, each_pair_is_told_by_its_own_evidence) {
  RankEvidence evidence = alike(1e-3);
  evidence.on_row[3][0].misfit = evidence.on_col[3][0].misfit = 4e-6 * kSamples;
  EXPECT_NEAR(predicted(evidence, 3, 0), 4e-4, 4e-4 * kRounding);  // √(4e-6 · 0.04)
  EXPECT_NEAR(predicted(evidence, 0, 3), 2e-4, 2e-4 * kRounding);
}

TEST(UndecayedMisfit, a_dominant_pair_must_be_tested) {
  // Fifteen pairs carry s each and one x s: its share is x / (15 + x), 0.45 at x = 12.27.
  for (const double x : {12.0, 12.5}) {
    RankEvidence evidence = alike(1e-3);
    evidence.on_row[1][2].signal *= x;
    EXPECT_TRUE(std::isfinite(predicted(evidence))) << "on one side only";
    evidence.on_col[1][2].signal *= x;
    EXPECT_EQ(std::isinf(predicted(evidence)), x > 12.27) << x;
    EXPECT_TRUE(std::isfinite(predicted(evidence, 0, 0))) << "another pair";
  }
}

TEST(UndecayedMisfit, a_misfit_that_could_do_harm_must_be_tested) {
  const double limit = 2.5 * 4 * 3e-4;  // κ 2^l τ_A
  EXPECT_TRUE(std::isfinite(predicted(alike(limit * 0.999))));
  EXPECT_TRUE(std::isinf(predicted(alike(limit * 1.001))));
  EXPECT_TRUE(std::isinf(predicted(alike(limit * 0.999), 1, 2, kLevel - 1))) << "half the limit, a level up";
}

TEST(UndecayedMisfit, the_harm_allowed_ends_at_the_largest_risk) {
  const double limit = 12 * 3e-4;  // κ 2⁵ = 80 is above κ_max = 12
  EXPECT_TRUE(std::isfinite(predicted(alike(limit * 0.999), 1, 2, 5)));
  EXPECT_TRUE(std::isinf(predicted(alike(limit * 1.001), 1, 2, 5)));
}

TEST(UndecayedMisfit, nothing_seen_must_be_tested) {
  RankEvidence evidence = alike(0);
  evidence.on_row[1][2] = evidence.on_col[1][2] = {};
  EXPECT_TRUE(std::isinf(predicted(evidence)));
}

TEST(UndecayedMisfit, a_diagonal_parent_tells_by_signal_alone) {
  RankEvidence evidence = alike(1.0);  // a misfit that would be infinite risk elsewhere
  evidence.diagonal = true;
  evidence.on_col = {};
  evidence.on_row[2][1].signal = kColSignal * kSamples;
  // s² m = 3² · 0.04: child 2 lit on 1 and child 1 lit on 2
  EXPECT_NEAR(predicted(evidence, 1, 2), 0.36, 0.36 * kRounding);
  EXPECT_NEAR(predicted(evidence, 2, 1), 0.36, 0.36 * kRounding);
  EXPECT_TRUE(std::isinf(predicted(evidence, 1, 1))) << "a diagonal child must be tested";
}

TEST(Decay, never_falls_below_its_start) {
  Decay decay(0.05);
  EXPECT_DOUBLE_EQ(decay.squared(), 0.0025);
  for (int k = 0; k < 5; ++k) decay.learn(0, 100);
  EXPECT_DOUBLE_EQ(decay.squared(), 0.0025);
}

TEST(Decay, grows_in_proportion_to_what_was_found) {
  for (const double factor : {2.0, 10.0, 300.0}) {
    Decay decay(0.05);
    const double nodes = 1e6;
    decay.learn(factor * nodes, nodes);
    // Eight nodes' worth of doubt: (f n + 8)/(n + 8) = f (1 − O(8/n))
    EXPECT_NEAR(decay.squared() / (0.0025 * factor), 1, 8 / nodes);
  }
}

TEST(Decay, a_small_sample_moves_it_less) {
  Decay few(0.05), many(0.05);
  few.learn(10 * 1, 1);
  many.learn(10 * 100, 100);
  EXPECT_GT(few.squared(), 0.0025);
  EXPECT_LT(few.squared(), many.squared());
}

TEST(Decay, falls_again_when_nodes_fit) {
  Decay decay(0.05);
  decay.learn(1000, 100);
  const double high = decay.squared();
  decay.learn(0, 100);
  EXPECT_LT(decay.squared(), high);
  EXPECT_GT(decay.squared(), 0.0025 * 0.999);
  for (int k = 0; k < 20; ++k) decay.learn(0, 100);
  EXPECT_DOUBLE_EQ(decay.squared(), 0.0025) << "down to where it began";
}

}  // namespace

}  // namespace symrig::acquisition::prediction_test
