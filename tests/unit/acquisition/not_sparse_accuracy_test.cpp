// SPDX-License-Identifier: Apache-2.0
// Transport that is not data-sparse, of many kinds and grids: photographs and errors stay within their
// bounds.
#include "dense_transport.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace symrig::not_sparse_accuracy_test {
namespace {

using namespace tests;

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

// Scenes with little but direct light: what goes between pixels looks wrong, or like noise, and is less than
// a twentieth of all light. Brute force would take 16,384 photographs for it.
TEST(NotSparse, little_light_is_no_reason_for_brute_force) {
  for (const auto& [scene, tolerance] : {std::pair{"sim:random?seed=3&size=128x128", 3e-4},
                                         std::pair{"sim:random?seed=8&size=128x128", 1.2e-3}}) {
    const auto rig = open_virtual_rig(scene);
    ASSERT_TRUE(rig.ok());
    CaptureOptions options;
    options.tolerance = tolerance;
    const auto result = capture(**rig, options);
    ASSERT_TRUE(result.ok());
    EXPECT_FALSE(result->undetermined) << scene;
    const Scene& truth = (*rig)->truth();
    const auto error = evaluate(
        result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return truth.apply(p); });
    ASSERT_TRUE(error.ok());
    EXPECT_LT(error->frobenius, 0.05) << scene;
  }
}

TEST(NotSparse, no_grid_takes_more_photographs_than_it_has_pixels) {
  for (const Grid grid : {Grid{1, 1}, Grid{1, 7}, Grid{2, 3}, Grid{7, 9}, Grid{8, 8}, Grid{1, 64},
                          Grid{65, 1}, Grid{5, 13}, Grid{9, 11}, Grid{13, 17}, Grid{16, 16}})
    for (const double sigma : {0.0, 1e-3}) {
      const CaptureOptions options{.unchecked = true};  // a single pixel may be black
      const auto pixels = static_cast<int>(grid.size());
      EXPECT_LE(run(facing_planes(grid), options, sigma).result.patterns, pixels) << to_string(grid);
      EXPECT_LE(run(transport(grid, gaussian(pixels, 11)), options, sigma).result.patterns, pixels)
          << to_string(grid);
      EXPECT_LE(run(transport(grid, positive(pixels, 12)), options, sigma).result.patterns, pixels)
          << to_string(grid);
      EXPECT_LE(run(transport(grid, pairs(pixels, 13)), options, sigma).result.patterns, pixels)
          << to_string(grid);
    }
}

}  // namespace
}  // namespace symrig::not_sparse_accuracy_test
