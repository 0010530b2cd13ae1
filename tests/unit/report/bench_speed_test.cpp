// SPDX-License-Identifier: Apache-2.0
// That something is measured, and what is done with it. How fast it is is no test's business.
// Curves made by hand: every expected number is worked out in the comment beside it.

#include "symrig/report/bench.hpp"

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace symrig::relight_speed_test {

namespace {

TransportTensor identity(Grid grid) {
  TensorBuilder builder(BlockTree(grid), 1);
  const std::array<float, 1> one{1};
  for (std::int32_t i = 0; i < grid.size(); ++i) builder.add_scalar(i, i, one);
  return std::move(builder).finish();
}

TEST(RelightSpeed, share_is_bytes_a_second_over_bytes_a_second) {
  const RelightSpeed speed{.array_bytes = 0, .tensor_bytes = 3'000'000, .one = {1, 12e9, 1e-3}, .all = {}};
  EXPECT_NEAR(speed.share_of_triad(speed.one), 0.25, 1e-12);  // 3 GB/s of 12
  EXPECT_EQ(speed.share_of_triad(speed.all), 0);              // not measured
}

TEST(RelightSpeed, measures_one_thread_and_all) {
  const TransportTensor tensor = identity({9, 7});
  int rounds = 0;
  const auto speed = measure_relight(
      tensor, {.array_bytes = 1 << 16, .rounds = 3, .progress = [&rounds](const ProgressEvent&) {
                 ++rounds;
                 return true;
               }});
  ASSERT_TRUE(speed.ok());
  EXPECT_EQ(rounds, 3);
  EXPECT_EQ(speed->array_bytes, 1 << 16);
  EXPECT_EQ(speed->tensor_bytes, tensor.bytes());
  EXPECT_EQ(speed->one.threads, 1);
  EXPECT_GE(speed->all.threads, 1);
  for (const ThreadSpeed& one : {speed->one, speed->all}) {
    EXPECT_GT(one.triad_bytes_per_second, 0);
    EXPECT_GT(one.relight_seconds, 0);
  }
}

TEST(RelightSpeed, can_be_stopped) {
  const auto speed = measure_relight(
      identity({3, 3}),
      {.array_bytes = 1 << 12, .rounds = 3, .progress = [](const ProgressEvent&) { return false; }});
  ASSERT_FALSE(speed.ok());
  EXPECT_EQ(speed.error().code, ErrorCode::interrupted);
}

TEST(RelightSpeed, refuses_what_cannot_be_measured) {
  const auto none = measure_relight(identity({3, 3}), {.array_bytes = 1 << 12, .rounds = 0, .progress = {}});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::bad_argument);
  const auto endless =
      measure_relight(identity({3, 3}), {.array_bytes = std::int64_t{1} << 55, .rounds = 1, .progress = {}});
  ASSERT_FALSE(endless.ok());
  EXPECT_EQ(endless.error().code, ErrorCode::limit);
}

}  // namespace

}  // namespace symrig::relight_speed_test

namespace symrig::speed_error_test {

namespace {

/// log, exp and pow of libm are within a few ulp; a handful of them in a row stays below this.
constexpr double kRounding = 1e-12;

void expect_points(const std::vector<CostError>& points, const std::vector<CostError>& expected) {
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_EQ(points[k].cost, expected[k].cost) << k;
    EXPECT_EQ(points[k].error, expected[k].error) << k;
  }
}

void expect_reading(const CurveReading& reading, Reach reach, double value) {
  EXPECT_EQ(reading.reach, reach);
  EXPECT_NEAR(reading.value, value, kRounding * value);
}

TEST(LowerEnvelope, of_a_monotone_curve_is_the_curve_in_order_of_cost) {
  expect_points(lower_envelope({{400, 0.01}, {100, 0.1}, {200, 0.03}}),
                {{100, 0.1}, {200, 0.03}, {400, 0.01}});
}

// 300 patterns err more than 200 did, 350 exactly as much: neither is worth its patterns.
TEST(LowerEnvelope, leaves_out_what_costs_more_and_is_not_better) {
  expect_points(lower_envelope({{100, 0.1}, {200, 0.03}, {300, 0.05}, {350, 0.03}, {400, 0.01}}),
                {{100, 0.1}, {200, 0.03}, {400, 0.01}});
}

TEST(LowerEnvelope, of_equal_costs_keeps_the_better) {
  expect_points(lower_envelope({{100, 0.2}, {100, 0.1}, {100, 0.3}}), {{100, 0.1}});
}

// The costliest capture is the worst: only the cheapest is left.
TEST(LowerEnvelope, of_a_curve_that_only_rises_is_its_first_point) {
  expect_points(lower_envelope({{10, 1}, {20, 2}, {40, 4}}), {{10, 1}});
}

TEST(LowerEnvelope, leaves_out_what_is_no_number) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  expect_points(
      lower_envelope({{nan, 1}, {10, nan}, {inf, 0}, {10, inf}, {0, 0.1}, {-1, 0.1}, {5, -0.1}, {7, 0}}),
      {{7, 0}});
  EXPECT_TRUE(lower_envelope({}).empty());
}

// Cost 100 → 400 while the error goes 0.1 → 0.001, straight in log-log. Half way in log error is 0.01, half
// way in log cost is 200.
TEST(CostAtError, is_straight_in_log_log) {
  const std::vector<CostError> curve{{100, 0.1}, {400, 0.001}};
  expect_reading(cost_at_error(curve, 0.01), Reach::read, 200);
  // A quarter of the way: 0.1 · 100^(-1/4), and 100 · 4^(1/4).
  expect_reading(cost_at_error(curve, 0.1 * std::pow(100, -0.25)), Reach::read, 100 * std::pow(4, 0.25));
}

TEST(CostAtError, at_a_capture_is_its_cost) {
  const std::vector<CostError> curve{{100, 0.1}, {200, 0.03}, {400, 0.01}};
  for (const CostError& p : curve) expect_reading(cost_at_error(curve, p.error), Reach::read, p.cost);
}

TEST(CostAtError, never_extrapolates) {
  const std::vector<CostError> curve{{100, 0.1}, {400, 0.01}};
  expect_reading(cost_at_error(curve, 0.0099), Reach::not_reached, 0);
  expect_reading(cost_at_error(curve, 0.2), Reach::at_most, 100);
  expect_reading(cost_at_error({}, 0.2), Reach::not_reached, 0);
  expect_reading(cost_at_error(curve, std::numeric_limits<double>::quiet_NaN()), Reach::not_reached, 0);
}

// Through the hump of a sweep that is not monotone the envelope goes from (100, 0.1) to (400, 0.001) as if
// the capture at 200 had not been.
TEST(CostAtError, on_a_sweep_with_a_hump_is_that_of_its_envelope) {
  const auto envelope = lower_envelope({{100, 0.1}, {200, 0.5}, {400, 0.001}});
  expect_reading(cost_at_error(envelope, 0.01), Reach::read, 200);
}

TEST(CostAtError, of_an_exact_capture_has_no_logarithm) {
  const std::vector<CostError> curve{{100, 0.1}, {400, 0}};
  expect_reading(cost_at_error(curve, 0), Reach::read, 400);
  expect_reading(cost_at_error(curve, 0.05), Reach::at_most, 400);
  expect_reading(cost_at_error(std::vector<CostError>{{21, 0}}, 0), Reach::read, 21);
}

TEST(ErrorAtCost, is_the_same_line_read_the_other_way) {
  const std::vector<CostError> curve{{100, 0.1}, {400, 0.001}};
  expect_reading(error_at_cost(curve, 200), Reach::read, 0.01);
  expect_reading(error_at_cost(curve, 400), Reach::read, 0.001);
  const CurveReading cost = cost_at_error(curve, 0.0123);
  expect_reading(error_at_cost(curve, cost.value), Reach::read, 0.0123);
}

TEST(ErrorAtCost, never_extrapolates) {
  const std::vector<CostError> curve{{100, 0.1}, {400, 0.01}};
  expect_reading(error_at_cost(curve, 99), Reach::not_reached, 0);
  expect_reading(error_at_cost(curve, 1000), Reach::at_most, 0.01);
  expect_reading(error_at_cost({}, 100), Reach::not_reached, 0);
}

TEST(ErrorAtCost, before_an_exact_capture_is_that_of_the_one_before) {
  const std::vector<CostError> curve{{100, 0.1}, {400, 0}};
  expect_reading(error_at_cost(curve, 399), Reach::at_most, 0.1);
  expect_reading(error_at_cost(curve, 400), Reach::read, 0);
}

TEST(Ratio, keeps_how_far_it_may_be_trusted) {
  expect_reading(ratio({Reach::read, 150}, 300), Reach::read, 0.5);
  expect_reading(ratio({Reach::at_most, 150}, 300), Reach::at_most, 0.5);
  expect_reading(ratio({}, 300), Reach::not_reached, 0);
}

TEST(Ratio, of_two_exact_results_is_one) {
  expect_reading(ratio({Reach::read, 0}, 0), Reach::read, 1);
  expect_reading(ratio({Reach::read, 0.1}, 0), Reach::not_reached, 0);
}

TEST(Larger, is_what_satisfies_both) {
  expect_reading(larger({Reach::read, 0.4}, {Reach::at_most, 0.6}), Reach::at_most, 0.6);
  expect_reading(larger({Reach::read, 0.6}, {Reach::at_most, 0.4}), Reach::read, 0.6);
  expect_reading(larger({Reach::at_most, 0.6}, {Reach::read, 0.6}), Reach::read, 0.6);
  expect_reading(larger({}, {Reach::read, 0.6}), Reach::not_reached, 0);
}

// √(0.25 · 4) = 1, ∛(0.1 · 0.01 · 1) = 0.1.
TEST(GeometricMean, is_the_root_of_the_product) {
  const std::vector<CurveReading> two{{Reach::read, 0.25}, {Reach::read, 4}};
  EXPECT_NEAR(geometric_mean(two).value, 1, kRounding);
  EXPECT_EQ(geometric_mean(two).reach(), Reach::read);
  const std::vector<CurveReading> three{{Reach::read, 0.1}, {Reach::read, 0.01}, {Reach::read, 1}};
  EXPECT_NEAR(geometric_mean(three).value, 0.1, kRounding);
}

TEST(GeometricMean, says_what_it_leaves_out) {
  const std::vector<CurveReading> ratios{{Reach::read, 0.25}, {Reach::at_most, 4}, {}, {Reach::read, 0}};
  const MeanRatio mean = geometric_mean(ratios);
  EXPECT_NEAR(mean.value, 1, kRounding);
  EXPECT_EQ(mean.averaged, 2);
  EXPECT_EQ(mean.bounds, 1);
  EXPECT_EQ(mean.not_reached, 1);
  EXPECT_EQ(mean.zero, 1);
  EXPECT_EQ(mean.reach(), Reach::not_reached);  // one is missing that would pull it up
}

TEST(GeometricMean, of_bounds_is_a_bound_and_of_nothing_is_nothing) {
  const std::vector<CurveReading> bounds{{Reach::at_most, 0.5}, {Reach::read, 0.5}};
  EXPECT_EQ(geometric_mean(bounds).reach(), Reach::at_most);
  EXPECT_EQ(geometric_mean({}).reach(), Reach::not_reached);
  EXPECT_EQ(geometric_mean({}).value, 0);
}

}  // namespace

}  // namespace symrig::speed_error_test
