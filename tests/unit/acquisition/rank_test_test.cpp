// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/rank_test.hpp"

#include "acquisition/tree/node.hpp"
#include "dense_scene.hpp"

#include <limits>

#include <gtest/gtest.h>

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
