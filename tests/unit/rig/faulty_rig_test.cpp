// SPDX-License-Identifier: Apache-2.0
// Whole rigs in virtual time whose devices misbehave: real firmware, real scenes, real noise.
#include "faulty_devices.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <cmath>
#include <cstdlib>
#include <memory>

#include <gtest/gtest.h>

namespace symrig::faulty_rig_test {
namespace {
using namespace probe_laws;  // NOLINT(google-build-using-namespace)

using test::CameraMischief;
using test::FaultyCamera;
using test::FaultyProjector;
using test::misfit;
using test::ProjectorMischief;

constexpr const char* kNoisy = "sim:vgroove-textured?size=24x32&exposures=4";
constexpr const char* kQuiet = "sim:vgroove-textured?size=24x32&exposures=4&noise=off";

/// A virtual rig between whose parts mischief may be put. Nobody sleeps while it waits.
struct Workshop {
  std::shared_ptr<CameraMischief> camera = std::make_shared<CameraMischief>();
  std::shared_ptr<ProjectorMischief> projector = std::make_shared<ProjectorMischief>();
  Pacing pacing = Pacing::trigger;
  std::function<void(RigOptions&)> options;
  std::function<Result<Board>(board_sim::SimBoard&)> board;
  Nanoseconds waited{0};

  VirtualRigHooks hooks() {
    VirtualRigHooks hooks;
    hooks.camera = [this](Camera& inner) { return FaultyCamera::open(inner, camera); };
    hooks.projector = [this](Projector& inner) { return FaultyProjector::open(inner, projector); };
    hooks.board = board;
    hooks.pacing = pacing;
    hooks.options = [this](RigOptions& set) {
      set.ledger.guards = 4;
      set.pause = [this](Nanoseconds time) { waited += time; };
      if (options) options(set);
    };
    return hooks;
  }
  std::unique_ptr<VirtualRig> open(const std::string& uri) {
    auto rig = open_virtual_rig(uri, hooks());
    EXPECT_TRUE(rig.ok()) << (rig.ok() ? "" : rig.error().line());
    return rig.ok() ? *std::move(rig) : nullptr;
  }
  /// From now on a quarter of all frames have something wrong with them.
  void let_loose() const {
    camera->lost = camera->lost_unnoticed = camera->copied = camera->renumbered = 0.03;
    camera->late_stamp = camera->late_arrival = camera->damaged = 0.04;
  }
};

std::vector<Pattern> distinct(Grid grid, int count) {
  return test::distinct_patterns(grid, count, 1000);
}

void expect_true(VirtualRig& rig, const std::vector<Pattern>& patterns) {
  const auto photographs = rig.measure(patterns);
  ASSERT_TRUE(photographs.ok()) << photographs.error().line();
  for (std::size_t i = 0; i < patterns.size(); ++i)
    EXPECT_LT(misfit(rig, patterns[i], (*photographs)[i]), 1.6) << "photograph " << i;
}

class FaultyRig : public testing::TestWithParam<Pacing> {};

// 24x32 pixels, patterns of which half are lit: a photograph of another pattern has a misfit of thousands.
TEST_P(FaultyRig, takes_only_photographs_of_what_it_was_asked_for) {
  Workshop shop;
  shop.pacing = GetParam();
  shop.options = [](RigOptions& options) { options.retakes = 60; };
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  shop.let_loose();
  const int count = std::getenv("SYMRIG_LONG") != nullptr ? 2500 : 120;
  expect_true(*rig, distinct(rig->grid(), count));
  const RigTrouble& trouble = rig->rig().trouble();
  EXPECT_GT(trouble.retaken, 0);
  for (const Verdict verdict : {Verdict::duplicated, Verdict::late, Verdict::damaged})
    EXPECT_GT(trouble.frames[verdict], 0) << name(verdict);
  EXPECT_GT(trouble.frames.missing, 0);
}

// The rig is told that the camera exposes 10 us shorter than its trigger is active, which it does not: a
// third of the shortest exposure that it meters with. The pixels say so.
TEST_P(FaultyRig, exposures_that_pixels_contradict_are_named) {
  Workshop shop;
  shop.pacing = GetParam();
  const auto sound = shop.open(kNoisy);
  ASSERT_NE(sound, nullptr);
  EXPECT_EQ(sound->rig().trouble().exposures, "");
  shop.options = [](RigOptions& options) {
    options.setup = options.setup.without(RigRole::strobe);
    options.setup.camera.exposure_offset = Nanoseconds{-10'000};
  };
  const auto wrong = shop.open(kNoisy);
  ASSERT_NE(wrong, nullptr);
  EXPECT_NE(wrong->rig().trouble().exposures.find("times by its exposures"), std::string::npos)
      << wrong->rig().trouble().exposures;
}

TEST_P(FaultyRig, the_test_would_notice_a_wrong_photograph) {
  Workshop shop;
  shop.pacing = GetParam();
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  const auto patterns = distinct(rig->grid(), 2);
  const auto photographs = measured(*rig, patterns);
  ASSERT_EQ(photographs.size(), 2U);
  EXPECT_GT(misfit(*rig, patterns[1], photographs[0]), 100);
}

TEST_P(FaultyRig, an_unplugged_camera_is_waited_for) {
  Workshop shop;
  shop.pacing = GetParam();
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  shop.camera->unplug_at = shop.camera->frames + 21;
  shop.camera->absent = 3;
  expect_true(*rig, distinct(rig->grid(), 12));
  EXPECT_EQ(rig->rig().trouble().cameras_reopened, 1);
  EXPECT_EQ(shop.waited, Nanoseconds{1'500'000'000});
}

TEST_P(FaultyRig, a_camera_that_does_not_come_back_is_named) {
  Workshop shop;
  shop.pacing = GetParam();
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  shop.camera->unplug_at = shop.camera->frames + 3;
  shop.camera->absent = 1'000'000;
  const auto photographs = rig->measure(distinct(rig->grid(), 4));
  ASSERT_FALSE(photographs.ok());
  EXPECT_EQ(photographs.error().code, ErrorCode::device_lost);
  EXPECT_NE(photographs.error().what.find("the camera was unplugged; it did not come back within 30 s"),
            std::string::npos)
      << photographs.error().line();
}

TEST_P(FaultyRig, a_wait_can_be_interrupted) {
  Workshop shop;
  shop.pacing = GetParam();
  shop.options = [](RigOptions& options) { options.keep_waiting = [] { return false; }; };
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  shop.camera->unplug_at = shop.camera->frames;
  shop.camera->absent = 1'000'000;
  const auto photographs = rig->measure(distinct(rig->grid(), 1));
  ASSERT_FALSE(photographs.ok());
  EXPECT_EQ(photographs.error().code, ErrorCode::interrupted);
}

TEST_P(FaultyRig, old_frames_of_a_stream_are_used_up_by_the_guards) {
  Workshop shop;
  shop.pacing = GetParam();
  shop.camera->stale = 3;
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  expect_true(*rig, distinct(rig->grid(), 8));
  EXPECT_GT(rig->rig().trouble().frames[Verdict::extra], 0);
  EXPECT_EQ(rig->rig().trouble().retaken, 0);
}

TEST_P(FaultyRig, gives_up_with_the_cause_after_so_many_tries) {
  Workshop shop;
  shop.pacing = GetParam();
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  shop.camera->lost = 1;
  const auto photographs = rig->measure(distinct(rig->grid(), 1));
  ASSERT_FALSE(photographs.ok());
  EXPECT_EQ(photographs.error().code, ErrorCode::frame_missing);
  EXPECT_NE(photographs.error().what.find("4 missing"), std::string::npos) << photographs.error().line();
  EXPECT_EQ(rig->rig().trouble().retaken, 6);  // once and five retakes
}

TEST_P(FaultyRig, a_board_that_was_restarted_is_configured_again) {
  Workshop shop;
  shop.pacing = GetParam();
  board_sim::SimBoard* simulated = nullptr;
  shop.board = [&simulated](board_sim::SimBoard& board) {
    simulated = &board;
    return Board::connect(make_sim_link(board));
  };
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  expect_true(*rig, distinct(rig->grid(), 3));
  simulated->reboot();
  expect_true(*rig, distinct(rig->grid(), 3));
  EXPECT_EQ(rig->rig().trouble().boards_reopened, 1);
}

TEST_P(FaultyRig, a_capture_under_faults_is_the_clean_capture) {
  CaptureOptions options;
  options.rule = default_rule(options.algorithm);
  options.economy = default_economy(options.algorithm);
  const auto clean_rig = Workshop().open(kQuiet);
  ASSERT_NE(clean_rig, nullptr);
  const auto clean = capture(*clean_rig, options);
  ASSERT_TRUE(clean.ok()) << clean.error().line();

  Workshop shop;
  shop.pacing = GetParam();
  shop.options = [](RigOptions& set) { set.retakes = 60; };
  const auto rig = shop.open(kQuiet);
  ASSERT_NE(rig, nullptr);
  shop.let_loose();
  // Without noise no content tells a copy, and one with a number of its own that takes the place of a lost
  // frame needs it (docs/ledger.md).
  shop.camera->renumbered = 0;
  const auto result = capture(*rig, options);
  ASSERT_TRUE(result.ok()) << result.error().line();
  EXPECT_GT(rig->rig().trouble().retaken, 0);
  EXPECT_EQ(result->patterns, clean->patterns);
  const auto truth = [&](const Image<float>& pattern) -> Result<Image<float>> {
    return rig->truth().apply(pattern);
  };
  const auto error = evaluate(result->tensor, truth), clean_error = evaluate(clean->tensor, truth);
  ASSERT_TRUE(error.ok() && clean_error.ok());
  EXPECT_NEAR(error->frobenius, clean_error->frobenius, 1e-3 * clean_error->frobenius);
  EXPECT_NEAR(error->flood, clean_error->flood, 1e-3 * clean_error->frobenius);
}

INSTANTIATE_TEST_SUITE_P(Pacings, FaultyRig, testing::Values(Pacing::trigger, Pacing::host),
                         [](const auto& one) { return one.param == Pacing::host ? "host" : "trigger"; });

TEST(HostPacedRig, keeps_the_probe_laws) {
  Workshop shop;
  shop.pacing = Pacing::host;
  const auto rig = shop.open("sim:vgroove-textured?size=20x20");
  ASSERT_NE(rig, nullptr);
  expect_probe_laws(*rig);
  EXPECT_EQ(rig->rig().trouble().retaken, 0);
}

TEST(HostPacedRig, an_unplugged_screen_is_waited_for_and_loaded_again) {
  Workshop shop;
  shop.pacing = Pacing::host;
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  shop.projector->unplug_at = shop.projector->shows + 5;
  shop.projector->absent = 2;
  expect_true(*rig, distinct(rig->grid(), 9));
  EXPECT_EQ(rig->rig().trouble().projectors_reopened, 1);
}

TEST(HostPacedRig, a_screen_whose_count_stands_still_is_not_believed) {
  Workshop shop;
  shop.pacing = Pacing::host;
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  shop.projector->count_stands = true;
  const auto photographs = rig->measure(distinct(rig->grid(), 2));
  ASSERT_FALSE(photographs.ok());
  EXPECT_EQ(photographs.error().code, ErrorCode::frame_missing);
  EXPECT_GT(rig->rig().trouble().patterns_late, 0);
}

TEST(HostPacedRig, exposures_before_the_pattern_are_not_used) {
  Workshop shop;
  shop.pacing = Pacing::host;
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  shop.projector->says_later = Nanoseconds{40'000'000};
  const auto photographs = rig->measure(distinct(rig->grid(), 1));
  ASSERT_FALSE(photographs.ok());
  EXPECT_GT(rig->rig().trouble().patterns_late, 0);
}

TEST(EvaluateByPhotographs, comes_to_what_the_truth_says) {
  Workshop shop;
  shop.pacing = Pacing::host;
  const auto rig = shop.open(kNoisy);
  ASSERT_NE(rig, nullptr);
  CaptureOptions options;
  options.rule = default_rule(options.algorithm);
  options.economy = default_economy(options.algorithm);
  const auto result = capture(*rig, options);
  ASSERT_TRUE(result.ok()) << result.error().line();
  const auto by_truth = evaluate(result->tensor, [&](const Image<float>& pattern) -> Result<Image<float>> {
    return rig->truth().apply(pattern);
  });
  const auto by_photographs = evaluate(result->tensor, *rig);
  ASSERT_TRUE(by_truth.ok() && by_photographs.ok());
  EXPECT_NEAR(by_photographs->frobenius, by_truth->frobenius, 0.15 * by_truth->frobenius);
  EXPECT_NEAR(by_photographs->indirect, by_truth->indirect, 0.3 * by_truth->indirect);
}

}  // namespace
}  // namespace symrig::faulty_rig_test
