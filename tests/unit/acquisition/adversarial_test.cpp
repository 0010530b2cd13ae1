// SPDX-License-Identifier: Apache-2.0
// Transport made to deceive the published rank test. docs/research/rank-test.md
#include "dense_scene.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::adversarial_test {
namespace {

using tests::DenseProbe;
using tests::DenseTransport;

struct Outcome {
  double error;
  std::int64_t patterns;
};

Outcome run(const DenseTransport& scene, Algorithm algorithm) {
  DenseProbe probe(scene);
  CaptureOptions options;
  options.algorithm = algorithm;
  options.rule = default_rule(algorithm);
  options.economy = default_economy(algorithm);
  const auto result = capture(probe, options);
  EXPECT_TRUE(result.ok());
  return {evaluate(result->tensor, scene.truth())->frobenius, result->patterns};
}

/// A permutation-like mirror between two small patches far apart: all the energy of every coarse node sits in
/// one child pair.
DenseTransport mirror_patch() {
  return {Grid{16, 16}, [](int i, int j) {
            const int a = std::min(i, j), b = std::max(i, j);
            const int ar = a / 16, ac = a % 16, br = b / 16, bc = b % 16;
            const bool facing = ar < 4 && ac < 4 && br >= 12 && bc >= 12;
            return facing && br - 12 == ac && bc - 12 == ar ? 1.0 : 0.0;
          }};
}

TEST(Adversarial, energy_in_one_child_pair_is_lost_by_the_paper_and_kept_by_the_guard) {
  const DenseTransport scene = mirror_patch();
  EXPECT_GT(run(scene, Algorithm::paper).error, 0.5);
  EXPECT_LE(run(scene, Algorithm::symrig).error, 1e-6);  // single entries: only rounding remains
}

TEST(Adversarial, a_permutation_over_the_whole_picture_is_exact) {
  const DenseTransport scene(Grid{8, 8}, [](int i, int j) { return i + j == 63 ? 1.0 : 0.0; });
  EXPECT_LE(run(scene, Algorithm::symrig).error, 1e-6);
}

/// The two colours of a checkerboard weigh the same in every block, so block patterns see a rank-1 transport.
DenseTransport checkerboard(int side) {
  const auto colour = [side](int i) { return (i / side + i % side) % 2; };
  return {Grid{side, side}, [=](int i, int j) { return colour(i) == colour(j) ? 0.02 : 0.0; }};
}

TEST(Adversarial, a_checkerboard_deceives_block_patterns_and_is_found_by_the_independent_ones) {
  for (const int side : {8, 16}) {
    const DenseTransport scene = checkerboard(side);
    EXPECT_GT(run(scene, Algorithm::paper).error, 0.3) << side;
    // Brute force takes over after eleven photographs:
    // NotSparse.a_checkerboard_is_found_by_the_held_out_photographs derives the bound.
    EXPECT_LE(run(scene, Algorithm::symrig).error, 1.5 * 11 / (side * side)) << side;
  }
}

TEST(Adversarial, energy_in_two_child_pairs) {
  // Both child pairs carry half: the concentration guard (0.8) is silent.
  const DenseTransport scene(Grid{16, 16}, [](int i, int j) {
    const int a = std::min(i, j), b = std::max(i, j);
    const int ar = a / 16, ac = a % 16, br = b / 16, bc = b % 16;
    const bool first = ar < 4 && ac < 4 && br >= 12 && bc >= 12 && br - 12 == ac && bc - 12 == ar;
    const bool second =
        ar >= 4 && ar < 8 && ac < 4 && br >= 12 && bc >= 8 && bc < 12 && br - 12 == ac && bc - 8 == ar - 4;
    return first || second ? 1.0 : 0.0;
  });
  EXPECT_LE(run(scene, Algorithm::symrig).error, 1e-3);
}

TEST(Adversarial, energy_along_a_block_border) {
  // Light goes only between the two pixel rows left and right of the middle of the picture.
  const DenseTransport scene(Grid{16, 16}, [](int i, int j) {
    if (i == j) return 0.5;
    const int a = i % 16, b = j % 16;
    return ((a == 7 && b == 8) || (a == 8 && b == 7)) && std::abs(i / 16 - j / 16) <= 1 ? 0.05 : 0.0;
  });
  EXPECT_LE(run(scene, Algorithm::symrig).error, 1e-3);
}

TEST(Adversarial, a_random_permutation) {
  // A symmetric one: pixels in random pairs.
  std::vector<int> partner(144);
  std::vector<int> order(144);
  for (int i = 0; i < 144; ++i) order[i] = i;
  Random random(5);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
  for (std::size_t i = 0; i < order.size(); i += 2) {
    partner[order[i]] = order[i + 1];
    partner[order[i + 1]] = order[i];
  }
  const DenseTransport scene(Grid{12, 12}, [&](int i, int j) { return partner[i] == j ? 1.0 : 0.0; });
  EXPECT_LE(run(scene, Algorithm::symrig).error, 1e-3);
}

}  // namespace
}  // namespace symrig::adversarial_test
