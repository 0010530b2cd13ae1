// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/statistics.hpp"
#include "symrig/tensor/internal/kernels.hpp"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace symrig::tensor::batch_kernels_test {
namespace {

constexpr double kEpsilon = 0x1p-24;

std::vector<float> random_values(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> values(n);
  for (float& v : values) v = static_cast<float>(random.uniform() - 0.4);
  return values;
}

// Every length up to two unrolled rounds and a tail. The bound of the card: n products, n − 1 sums, each
// rounded once: ≤ n ε Σ|b P| to first order, doubled for the second.
TEST(BatchKernels, dot_batch_is_the_dot_product_of_each_pattern) {
  for (std::size_t n = 0; n < 13; ++n) {
    const auto b = random_values(n, n + 1), p = random_values(n * kBatch, n + 2);
    std::array<float, kBatch> w{};
    dot_batch(b.data(), p.data(), n, w.data());
    for (std::size_t c = 0; c < kBatch; ++c) {
      double exact = 0, size = 0;
      for (std::size_t j = 0; j < n; ++j) {
        exact += double{b[j]} * double{p[j * kBatch + c]};
        size += std::abs(double{b[j]} * double{p[j * kBatch + c]});
      }
      EXPECT_LE(std::abs(double{w[c]} - exact), 2 * static_cast<double>(n) * kEpsilon * size)
          << n << " pixels, pattern " << c;
    }
  }
}

TEST(BatchKernels, add_scaled_batch_adds_to_each_pattern_and_to_nothing_else) {
  for (std::size_t n = 0; n < 7; ++n) {
    const auto a = random_values(n, 5), w = random_values(kBatch, 6);
    const auto before = random_values((n + 1) * kBatch, 7);
    auto y = before;
    add_scaled_batch(a.data(), w.data(), y.data(), n);
    for (std::size_t k = 0; k < y.size(); ++k) {
      const std::size_t i = k / kBatch;
      const double exact = double{before[k]} + (i < n ? double{a[i]} * double{w[k % kBatch]}
                                                      : 0.0);  // one fused or two roundings
      EXPECT_NEAR(y[k], exact, i < n ? 2 * kEpsilon : 0.0);
    }
  }
}

// Products with 1 and 0 are exact, and both add in one order: the same bits.
TEST(BatchKernels, masks_say_the_same_as_patterns_of_ones_and_zeros) {
  constexpr std::size_t kRows = 6, kPixels = 40;
  for (std::size_t cols = 1; cols < 20; ++cols) {
    const auto a = random_values(kRows, 1), b = random_values(cols, cols);
    Random random(cols);
    std::vector<LitMask> lit(kPixels);
    std::vector<float> p(kPixels * kBatch);
    for (std::size_t j = 0; j < kPixels; ++j) {
      lit[j] = static_cast<LitMask>(random.bits());
      for (std::size_t c = 0; c < kBatch; ++c) p[j * kBatch + c] = (lit[j] >> c & 1) != 0 ? 1 : 0;
    }
    for (const bool mirrored : {false, true}) {
      const LeafFactors leaf{a.data(), b.data(), 30, kRows, 3, cols, 1};
      auto by_mask = random_values(kPixels * kBatch, 4);
      auto by_pattern = by_mask;
      add_leaf_batch(leaf, mirrored, lit.data(), by_mask.data());
      add_leaf_batch(leaf, mirrored, p.data(), by_pattern.data());
      EXPECT_EQ(by_mask, by_pattern) << cols << " columns";
    }
  }
}

TEST(BatchKernels, a_leaf_is_applied_both_ways_when_mirrored) {
  constexpr std::size_t kRows = 5, kCols = 9, kRank = 2, kPixels = 20;
  const auto a = random_values(kRows * kRank, 1), b = random_values(kCols * kRank, 2);
  const auto p = random_values(kPixels * kBatch, 3);
  for (const bool mirrored : {false, true}) {
    std::vector<float> y(kPixels * kBatch);
    add_leaf_batch({a.data(), b.data(), 11, kRows, 1, kCols, kRank}, mirrored, p.data(), y.data());
    for (std::size_t c = 0; c < kBatch; ++c) {
      std::vector<double> exact(kPixels);
      for (std::size_t k = 0; k < kRank; ++k) {
        for (std::size_t i = 0; i < kRows; ++i) {
          for (std::size_t j = 0; j < kCols; ++j) {
            const double t = double{a[k * kRows + i]} * double{b[k * kCols + j]};
            exact[11 + i] += t * double{p[(1 + j) * kBatch + c]};
            if (mirrored) exact[1 + j] += t * double{p[(11 + i) * kBatch + c]};
          }
        }
      }
      // |a|, |b|, |p| ≤ 0.6: Σ|A||B||P| ≤ 2 · 9 · 0.6³ < 4, through at most 9 + 2 + 4 roundings.
      for (std::size_t i = 0; i < kPixels; ++i) EXPECT_NEAR(y[i * kBatch + c], exact[i], 15 * kEpsilon * 4);
    }
  }
}

}  // namespace
}  // namespace symrig::tensor::batch_kernels_test
