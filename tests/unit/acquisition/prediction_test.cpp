// SPDX-License-Identifier: Apache-2.0
#include "acquisition/tree/rank_test.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace symrig::acquisition::prediction_test {
namespace {

constexpr int kLevel = 2;                               // risk 2.5 · 2² = 10 tolerances
constexpr double kSamples = 50;                         // of a child pair, from one side
constexpr double kRowSignal = 0.02, kColSignal = 0.08;  // mean squares: m = √(0.02 · 0.08) = 0.04

const RankRule kRule = default_rule(Algorithm::symrig);  // τ_A = 3e-4, k = 3
const Economy kEconomy = default_economy(Algorithm::symrig);

/// Sixteen child pairs alike, each with a mean square misfit beyond noise of e² and the noise V a side.
RankEvidence alike(double e, double noise = 0) {
  const double allowed = noise_allowance(2 * noise, 2 * kSamples, kRule.noise_sigmas);
  const double misfit = e * e * kSamples + allowed / 2;
  RankEvidence evidence;
  for (auto& row : evidence.on_row) row.fill({misfit, kRowSignal * kSamples + noise, noise, kSamples, noise});
  for (auto& row : evidence.on_col) row.fill({misfit, kColSignal * kSamples + noise, noise, kSamples, noise});
  return evidence;
}

double predicted(const RankEvidence& evidence, int a = 1, int b = 2, int level = kLevel) {
  return undecayed_misfit(evidence, a, b, level, kRule, kEconomy);
}

constexpr double kRounding = 1e-12;  // relative: a dozen double operations

TEST(UndecayedMisfit, is_the_geometric_mean_of_misfit_and_signal) {
  // √(1e-6 · 0.04) = 2e-4
  EXPECT_NEAR(predicted(alike(1e-3)), 2e-4, 2e-4 * kRounding);
}

TEST(UndecayedMisfit, noise_counts_neither_as_misfit_nor_as_signal) {
  // The noise terms cancel but for their rounding: V ≈ 1 against a misfit of 5e-5.
  EXPECT_NEAR(predicted(alike(1e-3, 1.0)), 2e-4, 2e-4 * 1e-10);
  RankEvidence quiet = alike(0, 1.0);
  quiet.on_row[1][2].misfit = quiet.on_col[1][2].misfit = 0;  // below what noise explains
  EXPECT_EQ(predicted(quiet), 0);
}

TEST(UndecayedMisfit, noise_of_the_estimate_is_no_excuse_for_a_weak_signal) {
  // A bright estimate's shot noise makes its misfit uncertain, not the light that was measured.
  RankEvidence evidence = alike(1e-3);
  for (auto* table : {&evidence.on_row, &evidence.on_col})
    for (auto& row : *table)
      for (Comparison& pair : row) pair.noise = 2 * pair.signal;
  evidence.diagonal = true;
  EXPECT_GT(predicted(evidence), kEconomy.diagonal_spread * kEconomy.diagonal_spread * 0.999 * kRowSignal);
}

TEST(UndecayedMisfit, each_pair_is_told_by_its_own_evidence) {
  RankEvidence evidence = alike(1e-3);
  evidence.on_row[3][0].misfit = evidence.on_col[3][0].misfit = 4e-6 * kSamples;
  EXPECT_NEAR(predicted(evidence, 3, 0), 4e-4, 4e-4 * kRounding);  // √(4e-6 · 0.04)
  EXPECT_NEAR(predicted(evidence, 0, 3), 2e-4, 2e-4 * kRounding);
}

TEST(UndecayedMisfit, a_dominant_pair_must_be_tested) {
  // Fifteen pairs carry s each and one x s: its share is x / (15 + x), 0.45 at x = 12.27.
  for (const double x : {12.0, 12.5}) {
    RankEvidence evidence = alike(1e-3);
    evidence.on_row[1][2].signal *= x;
    EXPECT_TRUE(std::isfinite(predicted(evidence))) << "on one side only";
    evidence.on_col[1][2].signal *= x;
    EXPECT_EQ(std::isinf(predicted(evidence)), x > 12.27) << x;
    EXPECT_TRUE(std::isfinite(predicted(evidence, 0, 0))) << "another pair";
  }
}

TEST(UndecayedMisfit, a_misfit_that_could_do_harm_must_be_tested) {
  const double limit = 2.5 * 4 * 3e-4;  // κ 2^l τ_A
  EXPECT_TRUE(std::isfinite(predicted(alike(limit * 0.999))));
  EXPECT_TRUE(std::isinf(predicted(alike(limit * 1.001))));
  EXPECT_TRUE(std::isinf(predicted(alike(limit * 0.999), 1, 2, kLevel - 1))) << "half the limit, a level up";
}

TEST(UndecayedMisfit, the_harm_allowed_ends_at_the_largest_risk) {
  const double limit = 12 * 3e-4;  // κ 2⁵ = 80 is above κ_max = 12
  EXPECT_TRUE(std::isfinite(predicted(alike(limit * 0.999), 1, 2, 5)));
  EXPECT_TRUE(std::isinf(predicted(alike(limit * 1.001), 1, 2, 5)));
}

TEST(UndecayedMisfit, nothing_seen_must_be_tested) {
  RankEvidence evidence = alike(0);
  evidence.on_row[1][2] = evidence.on_col[1][2] = {};
  EXPECT_TRUE(std::isinf(predicted(evidence)));
}

TEST(UndecayedMisfit, a_diagonal_parent_tells_by_signal_alone) {
  RankEvidence evidence = alike(1.0);  // a misfit that would be infinite risk elsewhere
  evidence.diagonal = true;
  evidence.on_col = {};
  evidence.on_row[2][1].signal = kColSignal * kSamples;
  // s² m = 3² · 0.04: child 2 lit on 1 and child 1 lit on 2
  EXPECT_NEAR(predicted(evidence, 1, 2), 0.36, 0.36 * kRounding);
  EXPECT_NEAR(predicted(evidence, 2, 1), 0.36, 0.36 * kRounding);
  EXPECT_TRUE(std::isinf(predicted(evidence, 1, 1))) << "a diagonal child must be tested";
}

TEST(Decay, never_falls_below_its_start) {
  Decay decay(0.05);
  EXPECT_DOUBLE_EQ(decay.squared(), 0.0025);
  for (int k = 0; k < 5; ++k) decay.learn(0, 100);
  EXPECT_DOUBLE_EQ(decay.squared(), 0.0025);
}

TEST(Decay, grows_in_proportion_to_what_was_found) {
  for (const double factor : {2.0, 10.0, 300.0}) {
    Decay decay(0.05);
    const double nodes = 1e6;
    decay.learn(factor * nodes, nodes);
    // Eight nodes' worth of doubt: (f n + 8)/(n + 8) = f (1 − O(8/n))
    EXPECT_NEAR(decay.squared() / (0.0025 * factor), 1, 8 / nodes);
  }
}

TEST(Decay, a_small_sample_moves_it_less) {
  Decay few(0.05), many(0.05);
  few.learn(10 * 1, 1);
  many.learn(10 * 100, 100);
  EXPECT_GT(few.squared(), 0.0025);
  EXPECT_LT(few.squared(), many.squared());
}

TEST(Decay, falls_again_when_nodes_fit) {
  Decay decay(0.05);
  decay.learn(1000, 100);
  const double high = decay.squared();
  decay.learn(0, 100);
  EXPECT_LT(decay.squared(), high);
  EXPECT_GT(decay.squared(), 0.0025 * 0.999);
  for (int k = 0; k < 20; ++k) decay.learn(0, 100);
  EXPECT_DOUBLE_EQ(decay.squared(), 0.0025) << "down to where it began";
}

}  // namespace
}  // namespace symrig::acquisition::prediction_test
