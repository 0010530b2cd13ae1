// SPDX-License-Identifier: Apache-2.0
// Transport that is not data-sparse: never more photographs than brute force takes, and the evidence is told.
#include "acquisition/search/budget.hpp"
#include "dense_scene.hpp"
#include "judged_capture.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/base/statistics.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

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

// The search needs 99 photographs of 99 pixels. So no pixel is left to be lit alone, and none tells what to
// expect of the others.
TEST(NotSparse, a_search_that_leaves_brute_force_no_photograph_is_solved_by_what_it_found) {
  const tests::Judged judged = tests::judge("sim:vgroove-mixed?size=9x11&seed=88");
  ASSERT_TRUE(judged.result.undetermined);
  ASSERT_TRUE(judged.result.undetermined->completed);
  EXPECT_EQ(judged.result.patterns, 99);
  ASSERT_TRUE(judged.result.stated_error());
  EXPECT_LT(judged.truth.frobenius, *judged.result.stated_error());
  EXPECT_LT(judged.truth.frobenius, 0.02);  // twice the tolerance
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

/// Direct light of 1/2 to 1 and a checkerboard without noise. The checkerboard hides in block patterns and in
/// the held-out photographs until single pixels are lit; then its light seems to come from their neighbours.
DenseTransport lit_checkerboard(int side) {
  const double between = 1.0 / side / side;
  return {{side, side}, [=](int i, int j) {
            const bool same = (i / side + i % side) % 2 == (j / side + j % side) % 2;
            return (same ? between : 0) + (i == j ? 0.5 + 0.5 * (i % 7) / 6 : 0);
          }};
}

double best_of_record(const CaptureResult& result) {
  return *std::min_element(result.error_per_level.begin(), result.error_per_level.end());
}

TEST(NotSparse, a_level_that_makes_it_worse_calls_brute_force) {
  for (const int side : {16, 32}) {
    const Outcome outcome = run(lit_checkerboard(side));
    ASSERT_TRUE(outcome.result.undetermined) << side;
    EXPECT_TRUE(outcome.result.undetermined->completed);
    EXPECT_LE(outcome.result.patterns, side * side);
    EXPECT_LE(outcome.error, best_of_record(outcome.result)) << side;
  }
}

// What the search knew before stays, without what no photograph can have told: the half of the checkerboard
// that is not even, of norm 1/2, while T has at least that of its direct light, side / 2.
TEST(NotSparse, a_level_that_makes_it_worse_is_taken_back_if_brute_force_is_too_long) {
  constexpr int kSide = 32;
  const Outcome outcome = run(lit_checkerboard(kSide), {.max_patterns = 100});
  expect_told_and_not_completed(outcome, 100, "max_patterns");
  EXPECT_LE(outcome.error, 1.0 / kSide + best_of_record(outcome.result));
  ASSERT_TRUE(outcome.result.estimated);
  EXPECT_TRUE(std::isnan(outcome.result.estimated->frobenius));
  EXPECT_EQ(outcome.result.estimate_not_given.size(), 4);
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

namespace symrig::sparseness_test {

// When brute force takes over for leaves that the checks find wrong.

namespace {

using acquisition::Budget;
using acquisition::Photographer;
using acquisition::SearchFacts;
using acquisition::Sparseness;

class WrongLeaves : public testing::Test {
 protected:
  /// Leaves are reopened, and one round would take more photographs than their budget has.
  bool brute_force_takes_over(const Sparseness::Missed& before, double of_all_after_a_level) {
    const BlockTree tree(grid_);
    const CaptureSettings settings = *settings_of({});
    const SearchFacts facts{settings, tree, 1, {1.0}};
    tests::DenseProbe probe(scene_);
    const Photographer photographer(probe, nullptr, tree, {});
    Budget budget(settings, grid_.size(), photographer);
    budget.begin_reopening();
    Sparseness sparseness(facts, photographer, budget);
    sparseness.misses(before);
    sparseness.misses_of_all(of_all_after_a_level);
    const bool goes_on = sparseness.worth_searching(2, 100, 0);
    EXPECT_EQ(goes_on, !sparseness.brute_force_takes_over());
    return sparseness.brute_force_takes_over();
  }

 private:
  Grid grid_{16, 16};
  tests::DenseTransport scene_ = tests::facing_planes(grid_);
};

TEST_F(WrongLeaves, call_brute_force_if_most_light_between_pixels_is_missed) {
  EXPECT_TRUE(brute_force_takes_over({.between_pixels = 0.5, .of_all = 0.1}, 0.1));
}

TEST_F(WrongLeaves, do_not_call_it_if_little_of_all_light_is_missed) {
  EXPECT_FALSE(brute_force_takes_over({.between_pixels = 0.5, .of_all = 0.1}, 0.04));
}

// A level that is searched again measures all light anew. It must not forget that light between pixels is
// known well: on a bench with a camera of its own, the direct light alone errs by a twentieth.
TEST_F(WrongLeaves, do_not_call_it_if_little_light_between_pixels_is_missed) {
  EXPECT_FALSE(brute_force_takes_over({.between_pixels = 0.07, .of_all = 0.06}, 0.06));
}

}  // namespace

}  // namespace symrig::sparseness_test

namespace symrig::suspects_test {

// Leaves that the held-out photographs find wrong: where there are none, and where there are too many to
// mend.

namespace {

using tests::default_options;
using tests::DenseProbe;
using tests::DenseTransport;
using tests::facing_planes;

constexpr std::int64_t kChecks = 6;

TEST(Suspects, well_behaved_scenes_raise_no_alarm) {
  for (const Grid grid : {Grid{16, 16}, Grid{13, 17}, Grid{20, 20}}) {
    const DenseTransport scene = facing_planes(grid);
    for (const double sigma : {0.0, 1e-4, 1e-3}) {
      DenseProbe probe(scene, sigma);
      const auto result = capture(probe, default_options());
      ASSERT_TRUE(result.ok());
      EXPECT_EQ(result->suspects, 0) << to_string(grid) << ' ' << sigma;
    }
  }
}

TEST(Suspects, without_an_alarm_the_checks_cost_their_six_photographs_only) {
  for (const Grid grid : {Grid{16, 16}, Grid{13, 17}, Grid{20, 20}}) {
    const DenseTransport scene = facing_planes(grid);
    CaptureOptions six = default_options();
    six.economy->check_share = 0;
    CaptureOptions blind = six;
    blind.economy->checks = false;
    DenseProbe with(scene), without(scene);
    EXPECT_EQ(capture(with, six)->patterns, capture(without, blind)->patterns + kChecks) << to_string(grid);
  }
}

/// Light goes only between pixels of one colour of a checkerboard, all alike: T p is two sums.
class Checkerboard : public Probe {
 public:
  explicit Checkerboard(int side) : side_(side) {}
  Grid grid() const override { return {side_, side_}; }
  int channels() const override { return 1; }
  Image<float> image(const Image<float>& p) const {
    double sums[2] = {};
    for (int i = 0; i < side_ * side_; ++i) sums[colour(i)] += static_cast<double>(p.values()[i]);
    Image<float> y(grid());
    for (int i = 0; i < side_ * side_; ++i) y.values()[i] = static_cast<float>(0.001 * sums[colour(i)]);
    return y;
  }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    std::vector<Radiance> answers;
    for (const Pattern& p : patterns)
      answers.push_back({image(p), Image<float>(grid()), Image<std::uint8_t>(grid(), 1, std::uint8_t{1})});
    photographs_ += std::ssize(patterns);
    return answers;
  }
  ProbeCost cost() const override { return {photographs_, photographs_, 0, 0, 0}; }
  std::string describe() const override { return "checkerboard"; }

 private:
  int colour(int i) const { return (i / side_ + i % side_) % 2; }
  int side_;
  std::int64_t photographs_ = 0;
};

TEST(Suspects, a_checkerboard_too_large_for_the_budget_is_told) {
  Checkerboard scene(64);
  CaptureOptions options = default_options();
  options.max_patterns = 1000;  // brute force takes 4096
  const auto result = capture(scene, options);
  ASSERT_TRUE(result.ok());
  EXPECT_LE(result->patterns, options.max_patterns);
  const auto truth =
      evaluate(result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return scene.image(p); });
  // T is (11' + ss')/2 of equal norms, s = ±1 by colour; block patterns see the first half only.
  EXPECT_GT(truth->frobenius, 0.3);
  ASSERT_TRUE(result->estimated.has_value());
  EXPECT_GT(result->suspects, 0);
  EXPECT_GT(result->estimated->frobenius, 0.1);
  ASSERT_TRUE(result->undetermined);
  EXPECT_FALSE(result->undetermined->completed);
}

}  // namespace

}  // namespace symrig::suspects_test

namespace symrig::adversarial_test {

// Transport made to deceive the published rank test. docs/research/rank-test.md

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
