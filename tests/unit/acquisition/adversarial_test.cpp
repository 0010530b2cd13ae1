// SPDX-License-Identifier: Apache-2.0
// Transport made to deceive the published rank test. docs/decisions/rank-test.md
#include "dense_scene.hpp"
#include "symrig/acquisition/capture.hpp"

#include <gtest/gtest.h>

namespace symrig {
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

TEST(Adversarial, a_checkerboard_still_deceives_both) {
  // Known limit: the two colours of a checkerboard weigh the same in every block, so block patterns see a
  // rank-1 transport. Only an independent pattern can tell. When the test learns to, this expectation turns
  // around.
  const auto colour = [](int i) { return (i / 8 + i % 8) % 2; };
  const DenseTransport scene(Grid{8, 8}, [&](int i, int j) { return colour(i) == colour(j) ? 0.02 : 0.0; });
  EXPECT_GT(run(scene, Algorithm::paper).error, 0.3);
  EXPECT_GT(run(scene, Algorithm::symrig).error, 0.3);
}

}  // namespace
}  // namespace symrig
