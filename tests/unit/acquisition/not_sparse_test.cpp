// SPDX-License-Identifier: Apache-2.0
// Transport that is not data-sparse: never more photographs than brute force takes, and the evidence is told.
#include "dense_transport.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace symrig::not_sparse_test {
namespace {

using tests::checkerboard;
using tests::DenseTransport;
using tests::facing_planes;
using tests::flat_spectrum;
using tests::Outcome;
using tests::pairs;
using tests::run;
using tests::transport;

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
}  // namespace symrig::not_sparse_test
