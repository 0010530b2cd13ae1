// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/node.hpp"

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
