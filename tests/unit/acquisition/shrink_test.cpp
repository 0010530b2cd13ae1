// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/placement.hpp"
#include "workbench.hpp"

#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::shrink_test {
namespace {

constexpr Grid kGrid{23, 19};  // blocks of unequal sizes, some with two children
constexpr int kLevel = 1;
constexpr double kSigmas = 5;

class Shrink : public testing::Test {
 protected:
  std::vector<float> image(double (*value)(double)) const {
    std::vector<float> v(block().size());
    for (std::size_t t = 0; t < v.size(); ++t)
      v[t] = static_cast<float>(value(static_cast<double>(t) / block().size()));
    return v;
  }
  std::vector<float> noisy(const std::vector<float>& clean, double sigma) {
    std::vector<float> v = clean;
    for (float& x : v) x += static_cast<float>(sigma * gaussian_());
    return v;
  }
  std::vector<float> shrunk(std::vector<float> v, double sigma) const {
    shrink_noise(tree_, kLevel, block(), sigma * sigma, v);
    return v;
  }
  const Block& block() const { return tree_.level(kLevel)[2]; }

 private:
  BlockTree tree_{kGrid};
  tests::Gaussian gaussian_{5};
};

double sum(const std::vector<float>& v) {
  return std::accumulate(v.begin(), v.end(), 0.0);
}
double error(const std::vector<float>& a, const std::vector<float>& b) {
  double squares = 0;
  for (std::size_t t = 0; t < a.size(); ++t)
    squares += (static_cast<double>(a[t]) - b[t]) * (static_cast<double>(a[t]) - b[t]);
  return squares;
}

double nothing(double /*at*/) {
  return 0;
}
double flat(double /*at*/) {
  return 0.3;
}
double ramp(double at) {
  return at;
}
double edge(double at) {
  return at > 0.4 ? 1 : 0.1;
}
double fine(double at) {
  return std::sin(700 * at);
}

TEST_F(Shrink, keeps_the_sum) {
  for (const auto value : {nothing, flat, ramp, edge, fine})
    for (const double sigma : {1e-3, 1.0}) {
      const auto v = noisy(image(value), sigma);
      double size = 0;
      for (const float x : v) size += std::abs(static_cast<double>(x));
      // Each pixel is a sum of at most one mean a level, each rounded: six levels.
      EXPECT_NEAR(sum(shrunk(v, sigma)), sum(v),
                  8 * 0x1p-24 * (size + static_cast<double>(v.size()) * sigma));
    }
}

TEST_F(Shrink, leaves_a_bright_image_nearly_as_it_is) {
  for (const auto value : {ramp, edge, fine}) {
    const auto clean = image(value);
    // At most the p − 2 parts in Σ n d² / v are taken off: together no more than the noise.
    constexpr double kSigma = 1e-3;
    EXPECT_LE(error(shrunk(clean, kSigma), clean), static_cast<double>(clean.size()) * kSigma * kSigma);
  }
}

TEST_F(Shrink, leaves_little_of_noise_alone) {
  // The mean of n keeps 1/n of the energy, and each of the six scales two of its p parts on the average.
  constexpr double kSigma = 0.1;
  double left = 0, before = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const auto v = noisy(image(nothing), kSigma);
    left += error(shrunk(v, kSigma), image(nothing));
    before += error(v, image(nothing));
  }
  EXPECT_LT(left, 0.25 * before);
}

TEST_F(Shrink, makes_no_image_worse_on_the_average) {
  constexpr int kTrials = 200;
  for (const auto value : {nothing, flat, ramp, edge, fine})
    for (const double sigma : {0.01, 0.1, 0.5, 2.0}) {
      const auto clean = image(value);
      double gain = 0, squares = 0;
      for (int trial = 0; trial < kTrials; ++trial) {
        const auto v = noisy(clean, sigma);
        const double one = error(v, clean) - error(shrunk(v, sigma), clean);
        gain += one;
        squares += one * one;
      }
      // Stein: the expected gain is not negative; 5 standard errors of its mean, and rounding.
      EXPECT_GE(gain, -kSigmas * std::sqrt(squares) - 1e-6) << sigma;
    }
}

TEST_F(Shrink, is_asked_for_when_noise_is_a_quarter_of_the_energy) {
  const std::vector<float> v(100, 2.0F);  // 4 a pixel
  EXPECT_TRUE(is_noisy(v, 1.01));
  EXPECT_FALSE(is_noisy(v, 0.99));
}

}  // namespace
}  // namespace symrig::acquisition::shrink_test
