// SPDX-License-Identifier: Apache-2.0
#include "sim/variates.hpp"

#include "sim/hash.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::sim::variates_test {
namespace {

double normal_cdf(double z) {
  return 0.5 * std::erfc(-z / std::numbers::sqrt2);
}

TEST(NormalQuantile, inverts_the_distribution_function) {
  for (int k = -620; k <= 620; ++k) {
    if (k == 0) continue;
    const double z = 0.01 * k;
    const double u = normal_cdf(z);
    if (u > 0.99) continue;  // 1 − u has lost the digits there; the lower half shows the symmetric values
    EXPECT_NEAR(normal_quantile(u), z, 4e-7 * std::abs(z) + 1e-9) << z;
  }
  EXPECT_DOUBLE_EQ(normal_quantile(0.25), -normal_quantile(0.75));
  EXPECT_TRUE(std::isfinite(normal_quantile(0)));
}

/// P(N = n) from its logarithm.
double poisson_law(double mean, std::int64_t n) {
  return std::exp(static_cast<double>(n) * std::log(mean) - mean - std::lgamma(static_cast<double>(n) + 1));
}

/// Distribution function of the quantile's values, by bisecting for the u at which it steps from n to n + 1.
double cdf_of_quantile(double mean, std::int64_t n) {
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (poisson_quantile(mean, middle) <= n ? low : high) = middle;
  }
  return low;
}

TEST(PoissonQuantile, is_the_exact_law_at_small_means) {
  for (const double mean : {0.001, 0.3, 1.0, 4.5, 20.0, 49.9}) {
    double cdf = 0;
    for (std::int64_t n = 0; n < 120; ++n) {
      cdf += poisson_law(mean, n);
      if (cdf > 1 - 1e-9) break;
      EXPECT_NEAR(cdf_of_quantile(mean, n), cdf, 1e-12) << mean << " " << n;
    }
  }
  EXPECT_EQ(poisson_quantile(0, 0.999), 0);
  EXPECT_EQ(poisson_quantile(-1, 0.5), 0);
}

TEST(PoissonQuantile, is_close_to_the_law_at_large_means) {
  for (const double mean : {50.0, 73.3, 200.0, 5000.0, 20000.0}) {
    double cdf = 0, mean_of_quantile = 0, second = 0, before = 0;
    const auto reach = static_cast<std::int64_t>(mean + 9 * std::sqrt(mean));
    for (std::int64_t n = 0; n <= reach; ++n) {
      cdf += poisson_law(mean, n);
      if (n < static_cast<std::int64_t>(mean - 9 * std::sqrt(mean))) continue;
      const double drawn = cdf_of_quantile(mean, n);
      EXPECT_NEAR(drawn, cdf, 5e-4) << mean << " " << n;
      mean_of_quantile += static_cast<double>(n) * (drawn - before);
      second += std::pow(static_cast<double>(n) - mean, 2) * (drawn - before);
      before = drawn;
    }
    EXPECT_NEAR(mean_of_quantile, mean, 0.005) << mean;
    EXPECT_NEAR(second, mean, 1e-3 * mean) << mean;
  }
}

// With the counter-based hash as the source: chi-square over the values of a million draws. The limit is
// 5 sigmas of the chi-square law: one in 3.5 million runs fails, and the seed is fixed.
TEST(PoissonQuantile, passes_a_chi_square_test_with_hashed_counters) {
  constexpr int kDraws = 1'000'000;
  for (const double mean : {0.7, 12.0, 80.0}) {
    std::map<std::int64_t, int> count;
    for (std::uint64_t i = 0; i < kDraws; ++i) ++count[poisson_quantile(mean, unit_double(combine(77, i)))];
    double chi2 = 0;
    int bins = 0;
    for (std::int64_t n = 0; n < 200; ++n) {
      const double expected = kDraws * poisson_law(mean, n);
      if (expected < 10) continue;
      chi2 += std::pow(count[n] - expected, 2) / expected;
      ++bins;
    }
    EXPECT_LE(chi2, bins + 5 * std::sqrt(2.0 * bins)) << mean;
    EXPECT_GE(chi2, bins - 5 * std::sqrt(2.0 * bins)) << mean;
  }
}

}  // namespace
}  // namespace symrig::sim::variates_test
