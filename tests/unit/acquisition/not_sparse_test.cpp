// SPDX-License-Identifier: Apache-2.0
// Transport that is not data-sparse: never more photographs than brute force takes, and the evidence is told.
#include "dense_scene.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/base/random.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace symrig {
namespace {

using tests::DenseProbe;
using tests::DenseTransport;
using tests::facing_planes;

using Matrix = Eigen::MatrixXd;

DenseTransport transport(Grid grid, const Matrix& t) {
  return {grid, [&t](int i, int j) { return (t(i, j) + t(j, i)) / 2; }};
}

Matrix gaussian(int n, std::uint64_t seed) {
  tests::Gaussian random(seed);
  return Matrix::NullaryExpr(n, n, [&random] { return random(); });
}

/// Symmetric and orthogonal: all singular values are 1, whatever its blocks.
Matrix flat_spectrum(int n, std::uint64_t seed) {
  const Matrix q = Eigen::HouseholderQR<Matrix>(gaussian(n, seed)).householderQ();
  Random random(seed + 1);
  const Eigen::VectorXd signs =
      Eigen::VectorXd::NullaryExpr(n, [&random] { return random.uniform() < 0.5 ? -1.0 : 1.0; });
  return q * signs.asDiagonal() * q.transpose();
}

Matrix positive_semidefinite(int n, std::uint64_t seed) {
  const Matrix a = gaussian(n, seed);
  return a * a.transpose() / n;
}

Matrix positive(int n, std::uint64_t seed) {
  Random random(seed);
  return Matrix::NullaryExpr(n, n, [&random] { return random.uniform(); });
}

/// Pixels in random pairs that see each other.
Matrix pairs(int n, std::uint64_t seed) {
  std::vector<int> order(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) order[static_cast<std::size_t>(i)] = i;
  Random random(seed);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
  Matrix t = Matrix::Zero(n, n);
  for (std::size_t i = 0; i + 1 < order.size(); i += 2)
    t(order[i], order[i + 1]) = t(order[i + 1], order[i]) = 1;
  return t;
}

/// The two colours of a checkerboard weigh the same in every block.
DenseTransport checkerboard(int side) {
  const auto colour = [side](int i) { return (i / side + i % side) % 2; };
  return {Grid{side, side}, [=](int i, int j) { return colour(i) == colour(j) ? 0.02 : 0.0; }};
}

struct Outcome {
  CaptureResult result;
  double error = 0;
};

Outcome run(const DenseTransport& scene, const CaptureOptions& options = {}, double sigma = 0) {
  DenseProbe probe(scene, sigma);
  auto result = capture(probe, options);
  EXPECT_TRUE(result.ok()) << result.error().line();
  EXPECT_EQ(result->patterns, probe.cost().photographs);
  const double error = evaluate(result->tensor, scene.truth())->frobenius;
  return {*std::move(result), error};
}

/// Of photographs that a search took before brute force went on: those that tell nothing new. The last level
/// spans the levels before it and the flood-lit photograph, and one half of the checks the other.
double told_twice(const Undetermined& found) {
  constexpr std::int64_t kOwnChecks = 5;
  return static_cast<double>(found.patterns - found.levels.back().patterns - kOwnChecks);
}

TEST(NotSparse, a_flat_spectrum_takes_no_more_photographs_than_brute_force) {
  // d photographs that tell nothing new leave T unknown on d directions with themselves, d² of n² numbers, of
  // a transport that has the same energy in all: a relative error of d / n. It scatters by 1 / √(2 · 21) = 15
  // % for d = 6 (21 numbers): 1.5 is three deviations.
  const DenseTransport small = transport({10, 11}, flat_spectrum(110, 3));
  const DenseTransport large = transport({32, 32}, positive_semidefinite(1024, 5));
  for (const DenseTransport* scene : {&small, &large}) {
    const auto pixels = static_cast<double>(scene->grid().size());
    const Outcome outcome = run(*scene);
    EXPECT_LE(outcome.result.patterns, scene->grid().size());
    ASSERT_TRUE(outcome.result.undetermined);
    const Undetermined& found = *outcome.result.undetermined;
    EXPECT_TRUE(found.completed);
    EXPECT_GT(found.forecast, found.brute_force);
    EXPECT_EQ(found.brute_force, scene->grid().size());
    EXPECT_EQ(found.levels.back().leaves, 0);
    EXPECT_GT(found.levels.back().unexplained, 0.75);
    EXPECT_LE(outcome.error, 1.5 * told_twice(found) / pixels);
    ASSERT_TRUE(outcome.result.estimated);
    EXPECT_LE(outcome.error,
              outcome.result.estimated->frobenius + outcome.result.estimated_half_width.frobenius);
    EXPECT_TRUE(outcome.result.held_out.empty());  // they went into the tensor
  }
}

TEST(NotSparse, positive_light_without_structure_is_not_taken_for_smooth_light) {
  // Numbers between 0 and 1 scatter by 1 / √24 where both halves of T are averaged, around 1 / 2: at most
  // this share of T is left where photographs tell nothing.
  const double scatter = std::sqrt(1.0 / 24) / std::sqrt(1.0 / 4 + 1.0 / 24);
  for (const Grid grid : {Grid{10, 11}, Grid{32, 32}}) {
    const auto pixels = static_cast<int>(grid.size());
    const Outcome outcome = run(transport(grid, positive(pixels, 7)));
    EXPECT_LE(outcome.result.patterns, pixels);
    ASSERT_TRUE(outcome.result.undetermined) << pixels;
    const auto before = static_cast<double>(outcome.result.undetermined->patterns);
    EXPECT_LE(outcome.error, scatter * before / pixels) << pixels;
  }
}

TEST(NotSparse, a_checkerboard_is_found_by_the_held_out_photographs) {
  // Of T = t (a a' + b b'), a and b the two colours, what m photographs leave to the prior is at most what
  // lies between m pixels: t m of ‖T‖ = t n / √2.
  for (const int side : {8, 16, 17, 24, 32}) {
    const Outcome outcome = run(checkerboard(side));
    EXPECT_LE(outcome.result.patterns, side * side);
    ASSERT_TRUE(outcome.result.undetermined) << side;
    const auto before = static_cast<double>(outcome.result.undetermined->patterns);
    EXPECT_LE(outcome.error, std::numbers::sqrt2 * before / (side * side)) << side;
    EXPECT_LE(outcome.error,
              outcome.result.estimated->frobenius + outcome.result.estimated_half_width.frobenius);
  }
}

TEST(NotSparse, noise_is_no_worse_than_that_of_brute_force) {
  constexpr double kSigma = 1e-3;
  const DenseTransport scene = checkerboard(24);
  const Outcome brute = run(scene, {.algorithm = Algorithm::brute}, kSigma);
  const Outcome completed = run(scene, {}, kSigma);
  ASSERT_TRUE(completed.result.undetermined);
  EXPECT_LE(completed.error, brute.error);  // each entry was seen from both sides
  EXPECT_FALSE(std::isnan(completed.result.noise_check.shared_ratio));
  EXPECT_TRUE(completed.result.noise_check.findings.empty());
}

TEST(NotSparse, transport_between_pairs_of_pixels_is_sparse) {
  for (const int side : {12, 32}) {
    const Outcome outcome = run(transport({side, side}, pairs(side * side, 5)));
    EXPECT_FALSE(outcome.result.undetermined) << side;
    EXPECT_LT(outcome.result.patterns, side * side);
    EXPECT_LE(outcome.error, 1e-6) << side;
  }
}

TEST(NotSparse, no_grid_takes_more_photographs_than_it_has_pixels) {
  for (const Grid grid : {Grid{1, 1}, Grid{1, 7}, Grid{2, 3}, Grid{7, 9}, Grid{8, 8}, Grid{1, 64},
                          Grid{65, 1}, Grid{5, 13}, Grid{9, 11}, Grid{13, 17}, Grid{16, 16}})
    for (const double sigma : {0.0, 1e-3}) {
      const auto pixels = static_cast<int>(grid.size());
      EXPECT_LE(run(facing_planes(grid), {}, sigma).result.patterns, pixels) << to_string(grid);
      EXPECT_LE(run(transport(grid, gaussian(pixels, 11)), {}, sigma).result.patterns, pixels)
          << to_string(grid);
      EXPECT_LE(run(transport(grid, positive(pixels, 12)), {}, sigma).result.patterns, pixels)
          << to_string(grid);
      EXPECT_LE(run(transport(grid, pairs(pixels, 13)), {}, sigma).result.patterns, pixels)
          << to_string(grid);
    }
}

TEST(NotSparse, grids_of_fewer_than_64_pixels_are_brute_force) {
  const DenseTransport scene = facing_planes({7, 9});
  const Outcome searched = run(scene), brute = run(scene, {.algorithm = Algorithm::brute});
  EXPECT_EQ(searched.result.patterns, 63);
  EXPECT_TRUE(
      std::ranges::equal(searched.result.tensor.column_values(), brute.result.tensor.column_values()));
  EXPECT_EQ(run(scene, {.max_patterns = 20}).result.stopped_by, "max_patterns");  // then it chooses
  EXPECT_TRUE(run(facing_planes({8, 8})).result.tensor.column_values().empty());
}

void expect_told_and_not_completed(const Outcome& outcome, std::int64_t most, const char* stopped_by) {
  EXPECT_LE(outcome.result.patterns, most);
  EXPECT_EQ(outcome.result.stopped_by, stopped_by);
  ASSERT_TRUE(outcome.result.undetermined);
  EXPECT_FALSE(outcome.result.undetermined->completed);
}

TEST(NotSparse, a_budget_below_brute_force_is_kept_and_the_evidence_is_told) {
  const Outcome outcome = run(transport({10, 11}, flat_spectrum(110, 3)), {.max_patterns = 60});
  expect_told_and_not_completed(outcome, 60, "max_patterns");
}

TEST(NotSparse, memory_below_brute_force_ends_the_search_with_as_many_photographs) {
  const DenseTransport scene = transport({10, 11}, flat_spectrum(110, 3));
  const Outcome outcome =
      run(scene, {.memory_limit = 200'000});  // brute force: 24 bytes for each of 110² entries
  expect_told_and_not_completed(outcome, 110, "brute_force");
}

TEST(NotSparse, baselines_never_switch) {
  const DenseTransport scene = transport({10, 11}, flat_spectrum(110, 3));
  const Outcome paper = run(scene, {.algorithm = Algorithm::paper});
  EXPECT_GT(paper.result.patterns, 110);
  EXPECT_FALSE(paper.result.undetermined);
  EXPECT_EQ(run(scene, {.algorithm = Algorithm::brute}).result.patterns, 110);
}

// Patterns that are differences of others have light of both signs.
TEST(NotSparse, baselines_keep_negative_light) {
  const DenseTransport scene = transport({10, 11}, flat_spectrum(110, 3));
  // A column of T comes from single pixels, held in floats.
  EXPECT_LE(run(scene, {.algorithm = Algorithm::brute}).error, 110 * 0x1p-24);
  // Dual refines what is above its threshold in the photograph of a block; light of both signs may hide
  // there. All that it keeps at single pixels is right: half of T was lost as long as only positive light
  // counted.
  EXPECT_LE(run(scene, {.algorithm = Algorithm::dual, .dual_threshold = 1e-6}).error, 0.01);
}

}  // namespace
}  // namespace symrig
