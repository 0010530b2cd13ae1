// SPDX-License-Identifier: Apache-2.0
#include "sim/texture.hpp"

#include "sim/hash.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

namespace symrig::sim::texture_test {
namespace {

// First outputs of the splitmix64 sequence of seed 0, as published with it.
TEST(Hash, is_the_splitmix_finaliser) {
  EXPECT_EQ(mix(0x9e3779b97f4a7c15ULL), 0xe220a8397b1dcdafULL);
  EXPECT_EQ(mix(2 * 0x9e3779b97f4a7c15ULL), 0x6e789e6aa1b965f4ULL);
}

TEST(Texture, stays_in_range_and_uses_it) {
  const auto albedo = texture({120, 90}, 3);
  const auto [low, high] = std::minmax_element(albedo.begin(), albedo.end());
  EXPECT_GE(*low, kDarkest);
  EXPECT_LE(*high, kBrightest);
  const double mean = std::accumulate(albedo.begin(), albedo.end(), 0.0) / 10800;
  double variance = 0;
  for (const float a : albedo) variance += (a - mean) * (a - mean) / 10800;
  EXPECT_GT(std::sqrt(variance), 0.1);
  EXPECT_NEAR(mean, 0.45, 0.1);
}

// Grain alone has a standard deviation of 1.8 · 0.3 · 0.72 / √12 = 0.11; neighbours differ by √2 of that.
TEST(Texture, has_grain_of_one_pixel) {
  const auto albedo = texture({64, 64}, 4);
  double sum = 0;
  for (std::size_t i = 1; i < albedo.size(); ++i) sum += std::pow(albedo[i] - albedo[i - 1], 2);
  EXPECT_GT(std::sqrt(sum / static_cast<double>(albedo.size())), 0.1);
}

TEST(Texture, of_another_key_is_unrelated) {
  const auto a = texture({80, 80}, 1);
  const auto b = texture({80, 80}, 2);
  double aa = 0, ab = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - 0.45) * (a[i] - 0.45);
    ab += (a[i] - 0.45) * (b[i] - 0.45);
    bb += (b[i] - 0.45) * (b[i] - 0.45);
  }
  EXPECT_LT(std::abs(ab) / std::sqrt(aa * bb), 0.35);  // the coarsest patches leave few independent samples
}

}  // namespace
}  // namespace symrig::sim::texture_test
