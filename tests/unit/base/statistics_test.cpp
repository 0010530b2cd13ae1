// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/statistics.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::quantile_test {
namespace {

/// Different numbers in no order, with two that are the same.
std::vector<double> numbers(std::size_t count) {
  Random random(count + 1);
  std::vector<double> values(count);
  for (double& value : values) value = random.uniform() - 0.5;
  if (count > 1) values.back() = values.front();
  return values;
}

std::vector<double> sorted(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values;
}

TEST(Quantile, a_rank_counts_from_the_smallest) {
  for (std::size_t count = 1; count <= 30; ++count)
    for (std::size_t rank = 0; rank < count; ++rank) {
      std::vector<double> values = numbers(count);
      const std::vector<double> order = sorted(values);
      EXPECT_EQ(ranked(values, static_cast<std::ptrdiff_t>(rank)), order[rank]) << count;
      EXPECT_EQ(sorted(values), order) << "the values are only reordered";
    }
}

TEST(Quantile, a_share_is_rounded_down_to_a_rank) {
  std::vector<int> values{40, 10, 30, 20};
  EXPECT_EQ(quantile(values, 0), 10);
  EXPECT_EQ(quantile(values, 0.33), 10);
  EXPECT_EQ(quantile(values, 0.34), 20);
  EXPECT_EQ(quantile(values, 0.5), 20) << "the lower of the two in the middle";
  EXPECT_EQ(quantile(values, 0.99), 30);
  EXPECT_EQ(quantile(values, 1), 40);
}

TEST(Quantile, the_median_is_the_upper_middle) {
  for (std::size_t count = 1; count <= 30; ++count) {
    std::vector<double> values = numbers(count);
    const std::vector<double> order = sorted(values);
    EXPECT_EQ(median(values), order[count / 2]);
  }
}

TEST(Quantile, part_of_an_array_is_reordered_alone) {
  std::array<float, 5> values{3, 1, 2, -7, -8};
  EXPECT_EQ(median(std::span(values).first(3)), 2.F);
  EXPECT_EQ(values[3], -7.F);
  EXPECT_EQ(values[4], -8.F);
}

TEST(Quantile, of_nothing_is_zero) {
  std::vector<double> none;
  EXPECT_EQ(quantile(none, 0.5), 0);
  EXPECT_EQ(median(none), 0);
  EXPECT_EQ(robust_sigma(none), 0);
  EXPECT_EQ(robust_sigma(none, 3), 0);
}

/// The median of n normal |x| scatters by 1 / (2 φ √n) around 0.6745, φ = 2 × 0.3178 being their density
/// there: 0.0117 of it for n = 10,000. Five of these, and a tenth of outliers beyond 20 σ moves the median to
/// the quantile 0.5 / 0.9 of the others, which is 0.7647 instead of 0.6745: 13.4 % more.
TEST(Quantile, robust_sigma_is_that_of_a_normal_distribution) {
  constexpr std::size_t kCount = 10'000;
  constexpr double kSigma = 3, kCentre = 100;
  Random random(7);
  std::vector<double> values(kCount);
  for (double& value : values)
    value = kCentre + kSigma * std::sqrt(-2 * std::log(1 - random.uniform())) *
                          std::cos(2 * 3.14159265358979323846 * random.uniform());
  const std::vector<double> before = values;
  EXPECT_NEAR(robust_sigma(values), kSigma, 5 * 0.0117 * kSigma);
  EXPECT_NEAR(robust_sigma(values, kCentre), kSigma, 5 * 0.0117 * kSigma);
  EXPECT_EQ(values, before);
  EXPECT_GT(robust_sigma(values, kCentre + 2 * kSigma), 1.9 * kSigma) << "the centre that was given counts";
  for (std::size_t i = 0; i < kCount; i += 10) values[i] = kCentre + 20 * kSigma;
  EXPECT_NEAR(robust_sigma(values, kCentre), 1.134 * kSigma, 5 * 0.0117 * kSigma);
}

}  // namespace
}  // namespace symrig::quantile_test

namespace symrig::tukey_test {
namespace {

TEST(Tukey, counts_less_the_farther_a_residual_is) {
  EXPECT_EQ(tukey_weight(0), 1);
  EXPECT_DOUBLE_EQ(tukey_weight(kTukeyReach / 2), 0.5625);
  EXPECT_DOUBLE_EQ(tukey_weight(-kTukeyReach / 2), 0.5625);
}

TEST(Tukey, beyond_its_reach_nothing_counts) {
  EXPECT_EQ(tukey_weight(kTukeyReach), 0);
  EXPECT_EQ(tukey_weight(-1e9), 0);
  EXPECT_EQ(tukey_weight(std::numeric_limits<double>::infinity()), 0);
}

}  // namespace
}  // namespace symrig::tukey_test
