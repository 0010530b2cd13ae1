// SPDX-License-Identifier: Apache-2.0

#include "sim/light/random.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace symrig::sim {

namespace {

constexpr int kMostTerms = 256;  // at mean 50, probabilities beyond 200 are below double precision

/// 1/n, n = 1.. : divisions would take most of the time of the sum.
constexpr std::array<double, kMostTerms> kReciprocal = [] {
  std::array<double, kMostTerms> r{};
  for (int n = 1; n < kMostTerms; ++n) r[n] = 1.0 / n;
  return r;
}();

std::int64_t exact_quantile(double mean, double u) {
  double term = std::exp(-mean);
  double sum = term;
  std::size_t n = 0;
  while (sum < u && n + 1 < kMostTerms) {
    ++n;
    term *= mean * kReciprocal[n];
    sum += term;
  }
  return static_cast<std::int64_t>(n);
}

/// Ratio of two cubics at r, used in all three ranges. The last denominator coefficient may be 0.
double ratio(double r, const std::array<double, 4>& a, const std::array<double, 3>& b) {
  return (((a[3] * r + a[2]) * r + a[1]) * r + a[0]) / (((b[2] * r + b[1]) * r + b[0]) * r + 1);
}

constexpr std::array<double, 4> kCentreA{3.3871327179, 5.0434271938e1, 1.5929113202e2, 5.9109374720e1};
constexpr std::array<double, 3> kCentreB{1.7895169469e1, 7.8757757664e1, 6.7187563600e1};
constexpr std::array<double, 4> kTailA{1.4234372777, 2.7568153900, 1.3067284816, 1.7023821103e-1};
constexpr std::array<double, 3> kTailB{7.3700164250e-1, 1.2021132975e-1, 0};
constexpr std::array<double, 4> kFarA{6.6579051150, 3.0812263860, 4.2868294337e-1, 1.7337203997e-2};
constexpr std::array<double, 3> kFarB{2.4197894225e-1, 1.2258202635e-2, 0};

}  // namespace

double normal_quantile(double u) {
  const double q = u - 0.5;
  if (std::abs(q) <= 0.425) return q * ratio(0.180625 - q * q, kCentreA, kCentreB);
  const double tail = std::max(std::min(u, 1 - u), std::numeric_limits<double>::min());
  const double r = std::sqrt(-std::log(tail));
  const double z = r <= 5 ? ratio(r - 1.6, kTailA, kTailB) : ratio(r - 5, kFarA, kFarB);
  return q < 0 ? -z : z;
}

std::int64_t poisson_quantile(double mean, double u) {
  if (mean <= 0) return 0;
  if (mean < kExactPoissonMean) return exact_quantile(mean, u);
  const double z = normal_quantile(u);
  const double sigma = std::sqrt(mean - 1.0 / 12);  // rounding to whole electrons adds 1/12 (Sheppard)
  const double n = mean + sigma * z + (z * z - 1) / 6 + z * (1 - z * z) / (72 * sigma);
  return std::max<std::int64_t>(0, static_cast<std::int64_t>(std::floor(n + 0.5)));
}

}  // namespace symrig::sim
