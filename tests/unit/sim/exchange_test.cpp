// SPDX-License-Identifier: Apache-2.0
#include "sim/exchange.hpp"

#include "sim/gaussian_sum.hpp"
#include "sim/lane_fft.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::sim::exchange_test {
namespace {

TEST(InverseSquare, keeps_its_relative_error_over_seven_decades) {
  const GaussianSum sum = inverse_square(1, 3e6);
  EXPECT_LE(sum.rate.size(), 48U);
  double worst = 0;
  constexpr int kSteps = 1498;  // 1.01^1498 is 2.98e6
  for (int k = 0; k <= kSteps; ++k) {
    const double u = std::pow(1.01, k);
    double value = 0;
    for (std::size_t q = 0; q < sum.rate.size(); ++q) value += sum.weight[q] * std::exp(-sum.rate[q] * u);
    worst = std::max(worst, std::abs(value * u * u - 1));
  }
  EXPECT_LE(worst, kGaussianSumError);
  EXPECT_GT(worst, 0);
}

bool left(const Groove& groove, int col) {
  return col < groove.left_cols;
}

/// F of two pixels by the formula; 0 on one plane.
double exact(const Groove& groove, int row, int col, int row2, int col2, const Sight& sees) {
  if (left(groove, col) == left(groove, col2)) return 0;
  const double s = groove.distance[left(groove, col) ? col : col2];
  const double t = groove.distance[left(groove, col) ? col2 : col];
  return sees(s, t) ? point_form_factor(s, t, row - row2) : 0;
}

/// Largest |F − exact| over the allowance (relative, floor_of_pair) of each entry.
template <class Allowance>
double worst_ratio(const Exchange& exchange, const Groove& groove, const Sight& sees, Allowance allowance) {
  const std::size_t n = groove.grid.size();
  std::vector<float> unit(n, 0.F), column(n);
  double worst = 0;
  for (int row = 0; row < groove.grid.rows; ++row) {
    for (int col = 0; col < groove.grid.cols; ++col) {
      const std::size_t j = static_cast<std::size_t>(row) * groove.grid.cols + col;
      unit[j] = 1;
      exchange.apply(unit, column);
      unit[j] = 0;
      for (std::size_t i = 0; i < n; ++i) {
        const int row2 = static_cast<int>(i) / groove.grid.cols;
        const int col2 = static_cast<int>(i) % groove.grid.cols;
        const double truth = exact(groove, row, col, row2, col2, sees);
        const double peak = exact(groove, row, col, row, col2, sees);
        worst = std::max(worst, std::abs(column[i] - truth) / allowance(truth, peak));
      }
    }
  }
  return worst;
}

const Sight kAll = [](double, double) { return true; };

TEST(OpenExchange, matches_every_point_to_point_form_factor) {
  for (const Grid grid : {Grid{19, 23}, Grid{3, 60}, Grid{70, 4}, Grid{1, 30}, Grid{5, 2}}) {
    const Groove groove(grid);
    const auto exchange = open_exchange(groove);
    const double worst = worst_ratio(*exchange, groove, kAll, [](double truth, double) {
      return (kGaussianSumError + kExchangeRounding) * truth + 1e-30;
    });
    EXPECT_LE(worst, 1) << to_string(grid);
    EXPECT_GT(worst, 0) << to_string(grid);
  }
}

// Bound of exchange.hpp: 3e-6 of the largest entry of the pair of columns, whose energy may sit in
// another column of the same row; transforms mix rows, not columns.
TEST(MaskedExchange, matches_every_visible_form_factor) {
  for (const Grid grid : {Grid{19, 23}, Grid{33, 12}, Grid{1, 30}, Grid{5, 2}}) {
    const Groove groove(grid);
    const Sight sees = [&](double s, double t) { return passes_hovering_fin(groove, s, t); };
    const auto exchange = masked_exchange(groove, sees);
    const double worst =
        worst_ratio(*exchange, groove, sees, [](double, double peak) { return 3e-6 * peak + 2e-8; });
    EXPECT_LE(worst, 1) << to_string(grid);
    EXPECT_GT(worst, 0) << to_string(grid);
  }
}

// Closed form: a point s from the crease sees an endless strip of the other plane, W wide, under the form
// factor ½ (1 − s / √(s² + W²)). The groove is 401 long; what is missing at its ends is below W²/200² = 1 %,
// and point sums differ from areas by less than 1/(8 s²) of them.
TEST(OpenExchange, adds_up_to_the_form_factor_of_a_strip) {
  const Groove groove({401, 40});
  const auto exchange = open_exchange(groove);
  std::vector<float> light(groove.grid.size(), 1.F), seen(light.size());
  exchange->apply(light, seen);
  for (int col = 0; col < groove.left_cols; ++col) {
    const double s = groove.distance[col];
    const double width = groove.grid.cols - groove.crease;
    const double expected = 0.5 * (1 - s / std::sqrt(s * s + width * width));
    EXPECT_NEAR(seen[200 * 40 + col], expected, (0.012 + 0.13 / (s * s)) * expected) << s;
    EXPECT_LE(seen[200 * 40 + col], 0.51);
  }
}

TEST(PointFormFactor, needs_no_clamp) {
  double largest = 0;
  for (int cols = 2; cols < 200; ++cols) {
    const Groove groove({1, cols});
    if (groove.left_cols == 0) continue;
    const double s = groove.distance[static_cast<std::size_t>(groove.left_cols) - 1];
    const double t = groove.distance[groove.left_cols];
    largest = std::max(largest, point_form_factor(s, t, 0));
  }
  EXPECT_LE(largest, 0.23);
}

TEST(LaneFft, matches_the_sum_that_defines_it) {
  for (const std::size_t n : {1U, 2U, 8U, 64U}) {
    LaneSignal signal(n), scratch(n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t lane = 0; lane < kFftLanes; ++lane) {
        signal.re[i][lane] = static_cast<float>((i * 7 + lane * 3) % 11) - 5;
        signal.im[i][lane] = static_cast<float>((i * 5 + lane) % 13) - 6;
      }
    const LaneSignal given = signal;
    LaneFft(n).forward(signal, scratch);
    for (std::size_t k = 0; k < n; ++k) {
      std::complex<double> sum = 0;
      for (std::size_t i = 0; i < n; ++i)
        sum += std::complex<double>(given.re[i][5], given.im[i][5]) *
               std::polar(1.0, -2 * std::numbers::pi * double(i * k) / double(n));
      // 6 passes of roundings at 2⁻²⁴ of a norm of at most 8 √64
      EXPECT_NEAR(signal.re[k][5], sum.real(), 4e-5) << n << " " << k;
      EXPECT_NEAR(signal.im[k][5], sum.imag(), 4e-5) << n << " " << k;
    }
  }
}

}  // namespace
}  // namespace symrig::sim::exchange_test
