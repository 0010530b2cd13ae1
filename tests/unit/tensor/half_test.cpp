// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/internal/half.hpp"

#include "symrig/base/statistics.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

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
