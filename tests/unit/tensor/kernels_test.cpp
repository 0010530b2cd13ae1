// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/internal/kernels.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/tensor/internal/half.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

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

namespace symrig::tensor::lanes_test {
namespace {

std::vector<float> values(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> v(n);
  for (float& x : v) x = static_cast<float>(random.uniform());
  return v;
}

TEST(Lanes, gather_follows_any_order) {
  // Around the group of 16 and around the 256 that it looks ahead.
  for (const std::size_t n : {0U, 1U, 15U, 16U, 17U, 255U, 256U, 257U, 271U, 272U, 273U, 1000U}) {
    std::vector<std::int32_t> order(n);
    std::iota(order.begin(), order.end(), 0);
    Random random(n);
    for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
    const std::vector<float> from = values(n, 1);
    std::vector<float> to(n + 1, -1.0F);
    gather(order.data(), from.data(), to.data(), n);
    for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(to[i], from[order[i]]) << n << ": " << i;
    EXPECT_EQ(to[n], -1.0F) << n;
  }
}

TEST(Lanes, interleaving_and_back_moves_every_value_to_its_place) {
  for (std::size_t n = 0; n < 40; ++n) {
    std::vector<std::vector<float>> rows;
    LaneRows lanes{};
    for (std::size_t k = 0; k < kBatch; ++k) {
      rows.push_back(values(n, k));
      lanes[k] = rows[k].data();
    }
    std::vector<float> p(n * kBatch + 1, -1.0F);
    interleave(lanes, n, p.data());
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < kBatch; ++k) ASSERT_EQ(p[i * kBatch + k], rows[k][i]) << n;
    EXPECT_EQ(p[n * kBatch], -1.0F) << n;

    std::vector<std::vector<float>> back(kBatch, std::vector<float>(n + 1, -1.0F));
    LaneRowsOut out{};
    for (std::size_t k = 0; k < kBatch; ++k) out[k] = back[k].data();
    deinterleave(p.data(), n, out);
    for (std::size_t k = 0; k < kBatch; ++k) {
      rows[k].push_back(-1.0F);
      EXPECT_EQ(back[k], rows[k]) << n;
    }
  }
}

}  // namespace

}  // namespace symrig::tensor::lanes_test

namespace symrig::tensor::half_test {
namespace {

TEST(Half, every_half_that_is_a_number_comes_back) {
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    const float value = from_half(static_cast<Half>(bits));
    if (std::isnan(value)) continue;
    ASSERT_EQ(to_half(value), bits);
  }
  EXPECT_TRUE(std::isnan(from_half(to_half(std::nanf("")))));
  EXPECT_EQ(from_half(0x3C00), 1.0F);
  EXPECT_EQ(from_half(0x0001), 0x1p-24F);
  EXPECT_EQ(from_half(0xC000), -2.0F);
}

// Between two neighbouring halves lie the ones that are nearer to either, and the middle, which goes to even.
TEST(Half, rounding_is_to_the_nearest_and_ties_go_to_even) {
  for (std::uint32_t bits = 0; bits < 0x7BFF; bits += 7) {
    const auto below = static_cast<Half>(bits), above = static_cast<Half>(bits + 1);
    const float low = from_half(below), high = from_half(above), middle = 0.5F * (low + high);
    EXPECT_EQ(to_half(std::nextafter(middle, low)), below);
    EXPECT_EQ(to_half(std::nextafter(middle, high)), above);
    EXPECT_EQ(to_half(middle), bits % 2 == 0 ? below : above);
  }
  EXPECT_EQ(to_half(65519.0F), 0x7BFF);
  EXPECT_EQ(to_half(65520.0F), 0x7C00);
}

// The card's bound, for columns of every size that floats have: ½ ulp of 10 bits, and half a step of the
// smallest halves.
TEST(Half, a_column_keeps_its_error_bound_at_any_scale) {
  Random random(3);
  constexpr int kTop = 7;
  for (int exponent = -140; exponent <= 120; exponent += 13) {
    std::vector<float> values(100);
    for (float& v : values)
      v = static_cast<float>(
          std::ldexp(random.uniform() - 0.5, exponent - static_cast<int>(30 * random.uniform())));
    std::vector<Half> halves(values.size());
    const int scale = to_halves(values, kTop, halves.data());
    double largest = 0;
    for (const float v : values) largest = std::max(largest, std::abs(double{v}));
    for (std::size_t i = 0; i < values.size(); ++i)
      EXPECT_LE(std::abs(std::ldexp(double{from_half(halves[i])}, scale) - double{values[i]}),
                0x1p-11 * std::abs(double{values[i]}) + std::ldexp(largest, -25 - kTop));
  }
}

TEST(Half, rounding_twice_changes_nothing) {
  for (std::uint64_t seed = 1; seed < 200; ++seed) {
    Random random(seed);
    std::vector<float> values(9), again(9);
    for (float& v : values) v = static_cast<float>(random.uniform() * 1.01);
    values[0] = std::nextafter(2.0F, 0.0F);  // is rounded up into the next power of two
    std::vector<Half> first(9), second(9);
    const int scale = to_halves(values, 7, first.data());
    for (std::size_t i = 0; i < 9; ++i) again[i] = std::ldexp(from_half(first[i]), scale);
    EXPECT_EQ(to_halves(again, 7, second.data()), scale);
    EXPECT_EQ(first, second);
  }
}

TEST(Half, dark_and_broken_columns_are_no_trouble) {
  std::vector<Half> halves(3);
  EXPECT_EQ(to_halves(std::vector<float>{0, 0, 0}, 7, halves.data()), 0);
  EXPECT_EQ(halves, (std::vector<Half>{0, 0, 0}));
  to_halves(std::vector<float>{1, std::numeric_limits<float>::infinity(), std::nanf("")}, 7, halves.data());
  EXPECT_EQ(from_half(halves[0]), 128.0F);
  EXPECT_TRUE(std::isinf(from_half(halves[1])));
  EXPECT_TRUE(std::isnan(from_half(halves[2])));
}

}  // namespace

}  // namespace symrig::tensor::half_test
