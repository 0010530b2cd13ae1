// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/polish_jacobian.hpp"

#include "symrig/base/statistics.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::polish_jacobian_test {
namespace {

constexpr std::size_t kPixels = 16;
constexpr int kChannels = 2;

std::vector<float> signs(Random& random, std::size_t n) {
  std::vector<float> v(n);
  for (float& x : v) x = random.sign();
  return v;
}

/// Two leaves, one of them taken back, an entry off the diagonal and one on it.
KnownTransport small_transport(const BlockTree& tree, Random& random) {
  KnownTransport known(tree, kChannels);
  known.add_leaf(8, 12, 0, 4, 1, signs(random, std::size_t{kChannels} * 8));
  known.remove_leaf(known.add_leaf(12, 16, 0, 4, 1, signs(random, std::size_t{kChannels} * 8)));
  known.add_leaf(4, 8, 0, 4, 1, signs(random, std::size_t{kChannels} * 8));
  known.add_scalar(9, 6, signs(random, kChannels));
  known.add_scalar(3, 3, signs(random, kChannels));
  return known;
}

/// Seventeen photographs make one full batch and one that is nearly empty. Only some blocks are lit.
std::vector<PolishBatch> batches(Random& random) {
  std::vector<TreePhotograph> photographs(17);
  for (std::size_t k = 0; k < photographs.size(); ++k) {
    photographs[k].pattern.resize(kPixels);
    for (std::size_t t = 0; t < kPixels; ++t) photographs[k].pattern[t] = (t / 4 + k) % 3 == 0 ? 1.0F : 0.0F;
    photographs[k].mean = photographs[k].variance = std::vector<float>(kChannels * kPixels, 1.0F);
    for (float& w : photographs[k].variance) w = random.sign() > 0 ? 2.0F : 0.0F;
  }
  std::vector<PolishBatch> all;
  all.emplace_back(std::span(photographs).first(16));
  all.emplace_back(std::span(photographs).last(1));
  return all;
}

double inner(std::span<const float> a, std::span<const float> b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) sum += static_cast<double>(a[n]) * static_cast<double>(b[n]);
  return sum;
}

// s' (W J d) = (Jᵀ W s)' d for any d and s. Every factor is a sign, every weight 0 or 2: all sums are whole
// numbers far below 2²⁴, so both sides are exact.
TEST(PolishJacobian, gather_is_the_transpose_of_image) {
  const BlockTree tree(Grid{4, 4});
  Random random(7);
  const KnownTransport known = small_transport(tree, random);
  const PolishJacobian jacobian(known, kChannels);
  const std::vector<PolishBatch> seen = batches(random);
  PolishNumbers direction = signs(random, known.factors().size() + 2 * std::size_t{kChannels});
  const auto images = jacobian.image(seen, jacobian.tangents(direction));
  double forward = 0;
  std::vector<PolishSamples> weighted;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    PolishSamples s = signs(random, images[k].size());
    forward += inner(s, images[k]);
    for (std::size_t n = 0; n < s.size(); ++n) s[n] *= seen[k].weight[n];
    weighted.push_back(s);
  }
  PolishNumbers gradient(direction.size());
  jacobian.gather(seen, weighted, gradient);
  EXPECT_NE(forward, 0);
  EXPECT_EQ(inner(gradient, direction), forward);
}

// For an entry, diag(Jᵀ W J) is exactly |W^½ J e|² = Σ weight where its other pixel is lit.
TEST(PolishJacobian, diagonal_of_an_entry_is_its_own_curvature) {
  const BlockTree tree(Grid{4, 4});
  Random random(8);
  const KnownTransport known = small_transport(tree, random);
  const PolishJacobian jacobian(known, kChannels);
  const std::vector<PolishBatch> seen = batches(random);
  const std::size_t count = known.factors().size() + 2 * std::size_t{kChannels};
  PolishNumbers diagonal(count);
  jacobian.add_diagonal(seen, diagonal);
  for (std::size_t n = known.factors().size(); n < count; ++n) {
    PolishNumbers unit(count), curved(count);
    unit[n] = 1;
    jacobian.gather(seen, jacobian.image(seen, jacobian.tangents(unit)), curved);
    EXPECT_GT(diagonal[n], 0);
    EXPECT_EQ(curved[n], diagonal[n]);
  }
}

// Numbers of a leaf that was taken back do not move the photographs.
TEST(PolishJacobian, a_removed_leaf_does_not_count) {
  const BlockTree tree(Grid{4, 4});
  Random random(9);
  const KnownTransport known = small_transport(tree, random);
  const PolishJacobian jacobian(known, kChannels);
  const std::vector<PolishBatch> seen = batches(random);
  PolishNumbers direction(known.factors().size() + 2 * std::size_t{kChannels});
  for (std::size_t n = 16; n < 32; ++n) direction[n] = 1;
  for (const PolishSamples& image : jacobian.image(seen, jacobian.tangents(direction)))
    for (const float v : image) EXPECT_EQ(v, 0);
}

}  // namespace
}  // namespace symrig::acquisition::polish_jacobian_test
