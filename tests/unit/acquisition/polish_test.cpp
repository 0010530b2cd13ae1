// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/polish.hpp"

#include "acquisition/refine/polish_jacobian.hpp"
#include "dense_scene.hpp"
#include "symrig/base/statistics.hpp"
#include "workbench.hpp"

#include <atomic>
#include <cmath>
#include <limits>
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

namespace symrig::acquisition::polish_test {
namespace {

using tests::DenseProbe;
using tests::DenseTransport;
using tests::Workbench;

constexpr Grid kGrid{4, 8};
constexpr int kPixels = 32;

double factor(int i) {
  return 0.5 + Random(static_cast<std::uint64_t>(i) + 1).uniform();
}
bool right(int i) {
  return i % 8 >= 4;
}

/// Direct light, and rank-1 light between the left and the right half.
double entry(int i, int j) {
  if (i == j) return 1 + factor(i + 100);
  return right(i) != right(j) ? 0.05 * factor(i) * factor(j) : 0;
}

/// A log that fails after so many photographs have been read.
class FailingLog : public PhotographLog {
 public:
  explicit FailingLog(const PhotographLog& log) : log_(log) {}
  Grid grid() const override { return log_.grid(); }
  int channels() const override { return log_.channels(); }
  std::int64_t size() const override { return log_.size(); }
  Result<void> append_run(std::span<const Pattern>, std::span<const Radiance>, const ProbeCost&) override {
    return Error{ErrorCode::io, "read only", ""};
  }
  Result<Pattern> pattern(std::int64_t k) const override { return log_.pattern(k); }
  Result<Radiance> photograph(std::int64_t k) const override {
    if (reads_left-- <= 0) return Error{ErrorCode::io, "the disk is gone", "look for it"};
    return log_.photograph(k);
  }
  Result<void> read(std::int64_t k, LoggedPhotograph& to) const override {
    if (reads_left-- <= 0) return Error{ErrorCode::io, "the disk is gone", "look for it"};
    return log_.read(k, to);
  }
  Result<ProbeCost> spent(std::int64_t k) const override { return log_.spent(k); }

  mutable std::atomic<std::int64_t> reads_left = std::numeric_limits<std::int64_t>::max();

 private:
  const PhotographLog& log_;
};

class PolishTest : public testing::Test {
 protected:
  explicit PolishTest(double sigma = 0)
      : scene_(kGrid, entry), probe_(scene_, sigma), bench_(probe_), failing_(*bench_.log) {
    take();
    store();
  }

  /// Each pixel alone, and twelve random pictures: every entry is seen.
  void take() {
    std::vector<LitBlocks> patterns;
    patterns.reserve(kPixels + 12);
    for (std::int32_t t = 0; t < kPixels; ++t) patterns.push_back({{t, t + 1}});
    Random random(5);
    for (int k = 0; k < 12; ++k) {
      LitBlocks lit;
      for (std::int32_t t = 0; t < kPixels; ++t)
        if (random.uniform() < 0.5) lit.push_back({t, t + 1});
      patterns.push_back(lit);
    }
    ASSERT_TRUE(bench_.photographer.take("all", patterns).ok());
  }

  /// The scene as leaves between blocks of the first level, and scalars.
  void store() {
    const auto blocks = bench_.tree.level(1);
    const auto order = bench_.tree.order();
    for (std::size_t i = 0; i < blocks.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        if (right(order[blocks[i].begin]) == right(order[blocks[j].begin])) continue;
        std::vector<float> factors;
        for (std::int32_t t = blocks[i].begin; t < blocks[i].end; ++t)
          factors.push_back(static_cast<float>(0.05 * factor(order[t])));
        for (std::int32_t t = blocks[j].begin; t < blocks[j].end; ++t)
          factors.push_back(static_cast<float>(factor(order[t])));
        bench_.known.add_leaf(blocks[i].begin, blocks[i].end, blocks[j].begin, blocks[j].end, 1, factors);
      }
    for (std::int32_t t = 0; t < kPixels; ++t) {
      const int i = order[t];
      const auto value = static_cast<float>(entry(i, i));
      bench_.known.add_scalar(t, t, std::span(&value, 1));
    }
  }

  void perturb(double share) {
    Random random(9);
    for (float& v : bench_.known.change_factors())
      v *= static_cast<float>(1 + share * (2 * random.uniform() - 1));
    for (float& v : bench_.known.change_scalar_values())
      v *= static_cast<float>(1 + share * (2 * random.uniform() - 1));
  }

  Polish polish(double misfit = 1e-6) {
    return {bench_.facts, bench_.photographer, bench_.known, {{0, bench_.photographer.taken()}}, {misfit}};
  }

  std::vector<float> numbers() const {
    std::vector<float> all(bench_.known.factors().begin(), bench_.known.factors().end());
    all.insert(all.end(), bench_.known.scalar_values().begin(), bench_.known.scalar_values().end());
    return all;
  }

  /// Relative Frobenius error of what is stored, entry by entry.
  double error() const {
    const TransportTensor tensor = bench_.known.tensor();
    double squares = 0, total = 0;
    for (int j = 0; j < kPixels; ++j) {
      Image<float> lit(kGrid);
      lit.values()[j] = 1;
      const Image<float> column = *tensor.apply(lit);
      for (int i = 0; i < kPixels; ++i) {
        squares += std::pow(static_cast<double>(column.values()[i]) - entry(i, j), 2);
        total += entry(i, j) * entry(i, j);
      }
    }
    return std::sqrt(squares / total);
  }

  DenseTransport scene_;
  DenseProbe probe_;
  Workbench bench_;
  FailingLog failing_;
};

class NoisyPolish : public PolishTest {
 protected:
  NoisyPolish() : PolishTest(0.01) {}
};

TEST_F(PolishTest, the_weighted_misfit_never_rises) {
  for (const double share : {0.001, 0.1, 0.5, 2.0}) {
    perturb(share);
    Polish fit = polish();
    for (int k = 0; k < 6; ++k) {
      const auto outcome = fit.step(8);
      ASSERT_TRUE(outcome.ok());
      EXPECT_LE(outcome->after, outcome->before) << share << ", step " << k;
    }
  }
}

TEST_F(NoisyPolish, the_weighted_misfit_never_rises) {
  perturb(0.2);
  Polish fit = polish();
  double last = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 12; ++k) {
    const auto outcome = fit.step(8);
    ASSERT_TRUE(outcome.ok());
    EXPECT_LE(outcome->after, outcome->before) << k;
    // What a step begins with is what the last one ended with: the same sums, weights and photographs.
    EXPECT_LE(outcome->before, last * (1 + 1e-9)) << k;
    last = outcome->after;
  }
}

TEST_F(PolishTest, a_perturbed_exact_tensor_is_pulled_back) {
  perturb(0.05);
  const double wrong = error();
  ASSERT_GT(wrong, 0.02);
  Polish fit = polish();
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(fit.step(8).ok());
  // The photographs are exact and see every entry, so the minimum is the scene. Levenberg's tenth of the
  // diagonal slows a step down to leaving a share d/(d + 0.1) d⁻¹ of directions of curvature d; twenty steps
  // leave less than a hundredth of all that curve by over a fortieth of the diagonal.
  EXPECT_LE(error(), wrong / 100);
}

TEST_F(PolishTest, an_exact_tensor_stays) {
  const double rounding = error();
  Polish fit = polish();
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(fit.step(8).ok());
  // Residuals are roundings of floats: up to 36 terms of at most their sum, which itself is rounded.
  EXPECT_LE(error(), rounding + 40 * 0x1p-24);
}

TEST_F(NoisyPolish, noise_of_the_direct_light_falls_below_that_of_one_photograph) {
  // The scalars begin as one photograph has them. A pixel is lit alone once and in half of the twelve random
  // pictures: its entry becomes a mean of about seven samples less what the sixteen leaves' numbers take up.
  const auto order = bench_.tree.order();
  ASSERT_TRUE(bench_.photographer
                  .read(0, kPixels,
                        [&](std::int64_t first, std::span<TreePhotograph> photographs) {
                          for (std::size_t k = 0; k < photographs.size(); ++k) {
                            const auto t = static_cast<std::size_t>(first) + k;
                            bench_.known.change_scalar_values()[t] = photographs[k].mean[t];
                          }
                        })
                  .ok());
  const auto noise = [&] {
    double squares = 0;
    for (std::size_t t = 0; t < std::size_t{kPixels}; ++t)
      squares +=
          std::pow(static_cast<double>(bench_.known.scalar_values()[t]) - entry(order[t], order[t]), 2);
    return squares / kPixels;
  };
  constexpr double kVariance = 1e-4;
  // χ² of 32: √(2/32) = 1/4 a standard deviation.
  ASSERT_NEAR(noise(), kVariance, 5 * kVariance / 4);
  const double before = noise();
  Polish fit = polish();
  for (int k = 0; k < 10; ++k) ASSERT_TRUE(fit.step(8).ok());
  EXPECT_LT(noise(), before / 2);
}

/// A step whose reads fail after so many photographs.
TEST_F(PolishTest, a_log_that_fails_leaves_the_numbers_as_they_were) {
  perturb(0.05);
  const std::vector<float> before = numbers();
  Photographer photographer(bench_.logged, &failing_, bench_.tree, {});
  constexpr std::int64_t kTaken = kPixels + 12;
  Polish fit(bench_.facts, photographer, bench_.known, {{0, kTaken}}, {1e-6});
  // The first pass needs every photograph; later ones may have kept them.
  int failed = 0;
  for (std::int64_t reads = 0; reads < kTaken; reads += 2) {
    failing_.reads_left = reads;
    const auto outcome = fit.step(3);
    ASSERT_FALSE(outcome.ok()) << reads;
    EXPECT_EQ(outcome.error().code, ErrorCode::io);
    ASSERT_EQ(numbers(), before) << reads;
    ++failed;
  }
  EXPECT_GT(failed, 10);
  failing_.reads_left = std::numeric_limits<std::int64_t>::max();
  ASSERT_TRUE(fit.step(3).ok());
  EXPECT_NE(numbers(), before) << "the same step, once the log can be read";
}

TEST_F(PolishTest, a_removed_leaf_takes_no_part) {
  const std::vector<float> all = numbers();
  bench_.known.remove_leaf(0);
  Polish fit = polish();
  ASSERT_TRUE(fit.step(4).ok());
  const auto leaf = bench_.known.leaves()[0];
  const std::vector<float> now = numbers();
  for (std::int32_t k = 0; k < leaf.rows() + leaf.cols(); ++k) {
    const std::size_t at = leaf.factors + k;
    EXPECT_EQ(now[at], all[at]);
  }
}

}  // namespace

}  // namespace symrig::acquisition::polish_test
