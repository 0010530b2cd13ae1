// SPDX-License-Identifier: Apache-2.0
// Inverse transport against a slow oracle: projected gradients in doubles, until nothing moves.
#include "solve.hpp"

#include "assert_ok.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::solve_test {
namespace {

using mpi::Solution;
using mpi::solve;
using mpi::SolveOptions;

constexpr Grid kGrid{8, 8};
constexpr std::size_t kPixels = 64;

/// Direct light of uneven strength, and indirect light between all pixels.
TransportTensor scene(int channels) {
  Random random(4);
  TensorBuilder builder(BlockTree(kGrid), channels);
  for (std::int32_t i = 0; i < 64; ++i) {
    std::vector<float> direct(static_cast<std::size_t>(channels));
    for (float& v : direct) v = static_cast<float>(0.05 + random.uniform());
    builder.add_scalar(i, i, direct);
  }
  std::vector<float> factors;
  for (int channel = 0; channel < channels; ++channel) {
    std::vector<float> a(64);
    for (float& v : a) v = static_cast<float>(0.07 * random.uniform());
    factors.insert(factors.end(), a.begin(), a.end());
    factors.insert(factors.end(), a.begin(), a.end());
  }
  builder.add_leaf(0, 64, 0, 64, 1, 0, factors);
  return std::move(builder).finish();
}

Image<float> random_light(double most, std::uint64_t seed) {
  Random random(seed);
  Image<float> light(kGrid);
  for (float& v : light.values()) v = static_cast<float>(most * random.uniform());
  return light;
}

double norm(const Image<float>& picture) {
  double squares = 0;
  for (const float v : picture.values()) squares += static_cast<double>(v) * v;
  return std::sqrt(squares);
}

double residual(const TransportTensor& tensor, const Image<float>& light, const Image<float>& wanted) {
  Image<float> rest = *tensor.apply(light);
  for (std::size_t i = 0; i < rest.values().size(); ++i) rest.values()[i] -= wanted.values()[i];
  return norm(rest) / norm(wanted);
}

/// Columns of T, then p ← clip(p + Tᵀ(w − T p) / L) with L = ‖TᵀT‖_∞.
double least_residual(const TransportTensor& tensor, const Image<float>& wanted, double most) {
  const std::size_t rows = wanted.values().size();
  std::vector<double> t(rows * kPixels);
  for (std::size_t j = 0; j < kPixels; ++j) {
    Image<float> one(kGrid);
    one.values()[j] = 1;
    const Image<float> column = *tensor.apply(one);
    for (std::size_t i = 0; i < rows; ++i) t[i * kPixels + j] = column.values()[i];
  }
  const Image<float> white(kGrid, 1, 1.F);
  const Image<float> sums = *tensor.adjoint(*tensor.apply(white));
  const double steepest = *std::max_element(sums.values().begin(), sums.values().end());
  std::vector<double> p(kPixels), rest(rows);
  double length = 0;
  for (int step = 0; step < 40'000; ++step) {
    length = 0;
    for (std::size_t i = 0; i < rows; ++i) {
      rest[i] = wanted.values()[i];
      for (std::size_t j = 0; j < kPixels; ++j) rest[i] -= t[i * kPixels + j] * p[j];
      length += rest[i] * rest[i];
    }
    for (std::size_t j = 0; j < kPixels; ++j) {
      double back = 0;
      for (std::size_t i = 0; i < rows; ++i) back += t[i * kPixels + j] * rest[i];
      p[j] = std::clamp(p[j] + back / steepest, 0.0, most);
    }
  }
  return std::sqrt(length) / norm(wanted);
}

void expect_within(const Solution& found, double most) {
  for (const float v : found.light.values()) {
    EXPECT_GE(v, 0.F);
    EXPECT_LE(v, static_cast<float>(most));
  }
}

TEST(Solve, finds_a_light_that_exists) {
  for (const int channels : {1, 3}) {
    const TransportTensor tensor = scene(channels);
    const Image<float> wanted = *tensor.apply(random_light(1, 7));
    const auto found = solve(tensor, wanted, {});
    ASSERT_OK(found);
    EXPECT_TRUE(found->converged);
    EXPECT_LE(found->residual, 0.001);
    EXPECT_LE(found->applications, 50);
    // Float sums of 64 terms: the residual is measured with the light that is returned.
    EXPECT_NEAR(found->residual, residual(tensor, found->light, wanted), 64 * 0x1p-24);
    expect_within(*found, 1);
  }
}

TEST(Solve, is_as_good_as_the_oracle_where_no_light_reaches_the_picture) {
  for (const double most : {1.0, 0.3}) {
    const TransportTensor tensor = scene(1);
    Image<float> wanted = random_light(1, 9);
    wanted.values()[5] = -0.5F;
    const double best = least_residual(tensor, wanted, most);
    ASSERT_GT(best, 0.05);
    const SolveOptions options{.most = most, .tolerance = 0.002};
    const auto found = solve(tensor, wanted, options);
    ASSERT_OK(found);
    EXPECT_TRUE(found->converged);
    EXPECT_LE(found->residual, best + options.tolerance);
    // A proof below the best, to the rounding of sums of 64 floats.
    EXPECT_LE(found->unreachable, best + 64 * 0x1p-24);
    EXPECT_GE(found->unreachable, found->residual - options.tolerance);
    expect_within(*found, most);
  }
}

TEST(Solve, stops_at_the_limit_and_admits_it) {
  const TransportTensor tensor = scene(1);
  const Image<float> wanted = *tensor.apply(random_light(1, 7));
  const auto found = solve(tensor, wanted, {.tolerance = 1e-6, .applications = 6});
  ASSERT_OK(found);
  EXPECT_FALSE(found->converged);
  EXPECT_LE(found->applications, 6);
}

TEST(Solve, leaves_a_pixel_dark_that_nothing_sees) {
  TensorBuilder builder(BlockTree(kGrid), 1);
  const float one = 1;
  for (std::int32_t i = 1; i < 64; ++i) builder.add_scalar(i, i, std::span(&one, 1));
  const TransportTensor tensor = std::move(builder).finish();
  const auto found = solve(tensor, Image<float>(kGrid, 1, 0.5F), {});
  ASSERT_OK(found);
  EXPECT_EQ(found->light.values()[0], 0.F);
  // One of 64 equal pixels cannot be lit: √(1/64).
  EXPECT_NEAR(found->residual, 0.125, 0.001);
  EXPECT_NEAR(found->unreachable, 0.125, 0.001);
}

TEST(Solve, ends_when_it_is_interrupted) {
  const TransportTensor tensor = scene(1);
  const auto found = solve(tensor, random_light(1, 7), {}, [](const ProgressEvent&) { return false; });
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::interrupted);
}

TEST(Solve, refuses_what_it_cannot_solve) {
  const TransportTensor tensor = scene(1);
  const Image<float> wanted(kGrid, 1, 1.F);
  const auto code = [&](const Image<float>& picture, const SolveOptions& options) {
    const auto found = solve(tensor, picture, options);
    return found ? ErrorCode::fault : found.error().code;
  };
  EXPECT_EQ(code(Image<float>(Grid{8, 9}, 1, 1.F), {}), ErrorCode::size_mismatch);
  EXPECT_EQ(code(Image<float>(kGrid, 3, 1.F), {}), ErrorCode::size_mismatch);
  EXPECT_EQ(code(Image<float>(kGrid), {}), ErrorCode::bad_value);
  EXPECT_EQ(code(Image<float>(kGrid, 1, -1.F), {}), ErrorCode::bad_value);
  EXPECT_EQ(code(Image<float>(kGrid, 1, std::numeric_limits<float>::quiet_NaN()), {}), ErrorCode::bad_value);
  EXPECT_EQ(code(wanted, {.most = 0}), ErrorCode::bad_argument);
  EXPECT_EQ(code(wanted, {.most = std::numeric_limits<double>::infinity()}), ErrorCode::bad_argument);
  EXPECT_EQ(code(wanted, {.most = 1e30}), ErrorCode::bad_argument);
  EXPECT_EQ(code(wanted, {.tolerance = 0}), ErrorCode::bad_argument);
  EXPECT_EQ(code(wanted, {.applications = 3}), ErrorCode::bad_argument);
}

}  // namespace
}  // namespace symrig::solve_test
