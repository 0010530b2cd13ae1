// SPDX-License-Identifier: Apache-2.0
// Several pairs in one process are the single rig, to the last bit.
#include "symrig/rig/pairs.hpp"

#include "assert_ok.hpp"
#include "faulty_devices.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/sim/simulated_pairs.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace symrig::pairs_test {
namespace {

using namespace std::chrono_literals;
using probe_laws::law_pattern;
using test::CameraMischief;
using test::FaultyCamera;

std::unique_ptr<SimulatedPairs> open_pairs(const std::string& uri, ViewLayout layout,
                                           SimulatedPairHooks hooks = {}) {
  auto pairs = open_simulated_pairs(uri, layout, std::move(hooks));
  EXPECT_TRUE(pairs.ok()) << pairs.error().line();
  return *std::move(pairs);
}

std::vector<Pattern> some_patterns(Grid grid) {
  std::vector<Pattern> patterns{Pattern(grid, 1, 1.F), Pattern(grid)};
  for (int seed = 1; seed <= 3; ++seed) patterns.push_back(law_pattern(grid, seed));
  // Light of the first pair only: the others see what its light does in the scene.
  Pattern left(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols / 2; ++col) left.at(row, col) = 1;
  patterns.push_back(std::move(left));
  return patterns;
}

void expect_same(const std::vector<Radiance>& a, const std::vector<Radiance>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].mean, b[i].mean) << i;
    EXPECT_EQ(a[i].variance, b[i].variance) << i;
    EXPECT_EQ(a[i].valid, b[i].valid) << i;
  }
}

struct Case {
  std::string uri;
  ViewLayout layout;
};

class PairsOfAScene : public testing::TestWithParam<Case> {};

TEST_P(PairsOfAScene, take_the_photographs_of_one_rig) {
  const auto& [uri, layout] = GetParam();
  const auto one = open_virtual_rig(uri);
  ASSERT_OK(one);
  const auto pairs = open_pairs(uri, layout);
  EXPECT_EQ(pairs->grid(), (*one)->grid());
  EXPECT_EQ(pairs->views(), (*one)->views());
  const auto patterns = some_patterns(pairs->grid());
  for (int time = 0; time < 2; ++time) {
    const auto alone = (*one)->measure(patterns), together = pairs->measure(patterns);
    ASSERT_OK(alone);
    ASSERT_OK(together);
    expect_same(*alone, *together);
  }
  EXPECT_EQ(pairs->cost().frames, (*one)->cost().frames);
  EXPECT_EQ(pairs->cost().rig_seconds, (*one)->cost().rig_seconds);
}

INSTANTIATE_TEST_SUITE_P(
    Pairs, PairsOfAScene,
    testing::Values(Case{"sim:views2?size=24x20&noise=off", {1, 2}}, Case{"sim:views2?size=24x20", {1, 2}},
                    Case{"sim:views2?size=25x23&exposures=3", {2, 1}},
                    Case{"sim:views2?size=24x20&channels=3&dead=0.05", {2, 2}},
                    Case{"sim:views3?size=31x30&exposures=2&drift=0.1&flare=0.1", {1, 3}}));

TEST(Pairs, keep_the_laws_of_a_probe) {
  expect_probe_laws(*open_pairs("sim:views2?size=26x22&exposures=3&ratio=6", {1, 2}));
  expect_probe_laws(*open_pairs("sim:views2?size=26x22&noise=off", {2, 1}));
}

TEST(Pairs, light_of_one_reaches_the_camera_of_the_other) {
  const auto pairs = open_pairs("sim:views2?size=24x20&noise=off", {1, 2});
  const auto seen = pairs->measure(some_patterns({24, 20}));
  ASSERT_OK(seen);
  const Image<float> right = cut(seen->back().mean, {0, 10, {24, 10}});
  EXPECT_GT(*std::max_element(right.values().begin(), right.values().end()), 1e-3F);
}

TEST(Pairs, are_captured_as_one_rig) {
  const std::string uri = "sim:views2?size=16x16";
  const auto one = open_virtual_rig(uri);
  ASSERT_OK(one);
  const auto alone = capture(**one, {}), together = capture(*open_pairs(uri, {1, 2}), {});
  ASSERT_OK(alone);
  ASSERT_OK(together);
  EXPECT_EQ(alone->tensor.leaves().size(), together->tensor.leaves().size());
  const Pattern light = law_pattern({16, 16}, 9);
  EXPECT_EQ(*alone->tensor.apply(light), *together->tensor.apply(light));
}

TEST(Pairs, a_capture_goes_on_as_if_it_had_not_stopped) {
  const std::string uri = "sim:views2?size=16x14&exposures=2";
  const auto patterns = some_patterns({16, 14});
  const auto whole = open_pairs(uri, {1, 2});
  ASSERT_OK(whole->measure(patterns));
  const auto later = whole->measure(patterns);
  ASSERT_OK(later);
  const auto again = open_pairs(uri, {1, 2});
  ProbeCost spent;
  spent.photographs = std::ssize(patterns);
  ASSERT_OK(again->continue_after(spent));
  const auto resumed = again->measure(patterns);
  ASSERT_OK(resumed);
  expect_same(*later, *resumed);
}

/// Pairs of which one camera misbehaves.
std::unique_ptr<SimulatedPairs> open_faulty(std::size_t faulty,
                                            const std::shared_ptr<CameraMischief>& mischief,
                                            std::vector<std::unique_ptr<Camera>>& kept) {
  SimulatedPairHooks hooks;
  hooks.camera = [faulty, mischief, &kept](std::size_t pair, std::unique_ptr<Camera> camera) {
    if (pair != faulty) return camera;
    mischief->unplugged = false;
    kept.push_back(std::move(camera));
    return std::unique_ptr<Camera>(std::make_unique<FaultyCamera>(*kept.back(), mischief));
  };
  hooks.options = [](RigOptions& options) {
    options.pause = [](Nanoseconds) {};
    options.retakes = 40;
  };
  return open_pairs("sim:views2?size=24x20&noise=off", {1, 2}, std::move(hooks));
}

/// Each camera has its ledger: what one loses or swaps makes no photograph wrong.
TEST(Pairs, a_photograph_counts_only_if_the_frames_of_all_cameras_are_certain) {
  for (const std::size_t faulty : {0U, 1U}) {
    const auto mischief = std::make_shared<CameraMischief>();
    std::vector<std::unique_ptr<Camera>> kept;
    const auto pairs = open_faulty(faulty, mischief, kept);
    mischief->lost = mischief->lost_unnoticed = mischief->damaged = mischief->copied = 0.1;
    const auto sound = open_pairs("sim:views2?size=24x20&noise=off", {1, 2});
    const auto patterns = some_patterns({24, 20});
    for (int time = 0; time < 4; ++time) {
      const auto seen = pairs->measure(patterns), wanted = sound->measure(patterns);
      ASSERT_OK(seen);
      ASSERT_OK(wanted);
      expect_same(*wanted, *seen);
    }
    EXPECT_GT(pairs->rig().trouble().retaken, 0);
  }
}

TEST(Pairs, a_lost_camera_is_opened_again_and_the_photograph_taken_by_all) {
  const auto mischief = std::make_shared<CameraMischief>();
  std::vector<std::unique_ptr<Camera>> kept;
  const auto pairs = open_faulty(1, mischief, kept);
  const auto sound = open_pairs("sim:views2?size=24x20&noise=off", {1, 2});
  mischief->unplug_at = mischief->frames + 2;
  const auto patterns = some_patterns({24, 20});
  const auto seen = pairs->measure(patterns), wanted = sound->measure(patterns);
  ASSERT_OK(seen);
  ASSERT_OK(wanted);
  expect_same(*wanted, *seen);
  EXPECT_EQ(pairs->rig().trouble().cameras_reopened, 1);
}

/// Without mercy the rig gives up, and says which pair is to blame.
TEST(Pairs, a_camera_without_frames_is_named) {
  const auto mischief = std::make_shared<CameraMischief>();
  std::vector<std::unique_ptr<Camera>> kept;
  const auto pairs = open_faulty(1, mischief, kept);
  mischief->lost = 1;
  const auto seen = pairs->measure(some_patterns({24, 20}));
  ASSERT_FALSE(seen.ok());
  EXPECT_EQ(seen.error().code, ErrorCode::frame_missing);
  EXPECT_NE(seen.error().what.find("pair 2: "), std::string::npos) << seen.error().line();
  EXPECT_EQ(seen.error().what.find("pair 1: "), std::string::npos) << seen.error().line();
}

TEST(Pairs, need_views_that_can_be_dealt) {
  const auto groove = open_simulated_pairs("sim:vgroove-textured", {1, 2});
  ASSERT_FALSE(groove.ok());
  EXPECT_EQ(groove.error().code, ErrorCode::bad_argument);
  EXPECT_FALSE(open_simulated_pairs("sim:views2", {1, 3}).ok());
  EXPECT_FALSE(open_simulated_pairs("sim:views2?turn=3", {1, 2}).ok());
  EXPECT_FALSE(open_simulated_pairs("sim:views2?profile=dlpc350", {1, 2}).ok());
}

TEST(PairLayout, takes_pairs_that_tile_a_grid) {
  const std::vector<Grid> same(4, Grid{6, 5});
  const auto square = pair_layout({2, 2}, same);
  ASSERT_OK(square);
  EXPECT_EQ(square->cells, (Grid{12, 10}));
  EXPECT_EQ(square->tile(2), (Tile{6, 0, {6, 5}}));
  const std::vector<Grid> other{{6, 5}, {6, 7}};
  const auto uneven = pair_layout({1, 2}, other);
  ASSERT_FALSE(uneven.ok());
  EXPECT_EQ(uneven.error().code, ErrorCode::size_mismatch);
  EXPECT_TRUE(uneven.error().what.starts_with("pair 2") || uneven.error().what.starts_with("pair 1"));
  EXPECT_EQ(pair_layout({1, 3}, other).error().code, ErrorCode::bad_argument);
}

/// A screen that keeps what it was told.
class ToldScreen final : public Projector {
 public:
  struct State {
    std::vector<Pattern> loaded;
    std::uint64_t refresh = 0;
    bool stands = false, lost = false;
    Nanoseconds late{0};
  };
  explicit ToldScreen(std::shared_ptr<State> state, Pacing pacing = Pacing::host)
      : state_(std::move(state)), pacing_(pacing) {}
  Grid grid() const override { return {2, 3}; }
  Nanoseconds refresh_period() const override { return 10ms; }
  Pacing pacing() const override { return pacing_; }
  Result<void> load(std::span<const Pattern> patterns) override {
    state_->loaded.assign(patterns.begin(), patterns.end());
    return {};
  }
  Result<Shown> show(std::size_t /*index*/) override {
    if (state_->lost) return Error{ErrorCode::device_lost, "the screen was unplugged"};
    state_->refresh += state_->stands ? 0 : 1;
    return Shown{state_->refresh, {10ms * state_->refresh + state_->late}};
  }
  std::string describe() const override { return "a screen"; }

 private:
  std::shared_ptr<State> state_;
  Pacing pacing_;
};

TEST(JoinedProjectors, each_shows_its_part_and_the_last_one_counts) {
  const auto left = std::make_shared<ToldScreen::State>(), right = std::make_shared<ToldScreen::State>();
  right->late = 3ms;
  std::vector<std::unique_ptr<Projector>> screens;
  screens.push_back(std::make_unique<ToldScreen>(left));
  screens.push_back(std::make_unique<ToldScreen>(right));
  const PairLayout layout{{1, 2}, {2, 6}};
  const auto joined = join_projectors(std::move(screens), layout);
  ASSERT_OK(joined);
  Pattern pattern({2, 6});
  for (int col = 0; col < 6; ++col) pattern.at(1, col) = static_cast<float>(col) / 10;
  ASSERT_OK((*joined)->load({&pattern, 1}));
  EXPECT_EQ(left->loaded.front().at(1, 2), 0.2F);
  EXPECT_EQ(right->loaded.front().at(1, 0), 0.3F);
  const auto first = (*joined)->show(0), second = (*joined)->show(0);
  ASSERT_OK(first);
  ASSERT_OK(second);
  EXPECT_EQ(first->since.since, 13ms);
  EXPECT_GT(second->refresh, first->refresh);
  left->stands = true;
  const auto third = (*joined)->show(0);
  ASSERT_OK(third);
  EXPECT_EQ(third->refresh, second->refresh) << "one screen stands still";
  right->lost = true;
  const auto lost = (*joined)->show(0);
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().what, "pair 2: the screen was unplugged");
  const Pattern small({2, 3});
  EXPECT_EQ((*joined)->load({&small, 1}).error().code, ErrorCode::size_mismatch);
}

/// A camera that only has a timing.
class TimedCamera final : public Camera {
 public:
  explicit TimedCamera(CameraTiming timing) : timing_(timing) {}
  Grid grid() const override { return {2, 3}; }
  int channels() const override { return 1; }
  CameraTiming timing() const override { return timing_; }
  const NoiseModel& noise() const override { return noise_; }
  const Image<std::uint8_t>* dead() const override { return nullptr; }
  Result<std::vector<CameraFrame>> take(std::size_t /*count*/, Nanoseconds /*patience*/) override {
    return std::vector<CameraFrame>{};
  }
  std::string describe() const override { return "timed"; }

 private:
  CameraTiming timing_;
  NoiseModel noise_ = NoiseModel::from_electrons({});
};

Result<std::unique_ptr<Camera>> joined_cameras(CameraTiming first, CameraTiming second) {
  std::vector<std::unique_ptr<Camera>> cameras;
  cameras.push_back(std::make_unique<TimedCamera>(first));
  cameras.push_back(std::make_unique<TimedCamera>(second));
  return join_cameras(std::move(cameras), {{1, 2}, {2, 6}});
}

// The first takes its next trigger 3 ms after an exposure, the second one 4 ms.
TEST(JoinedCameras, wait_for_the_slowest_of_all) {
  const auto joined = joined_cameras({1ms, 2s, 5ms, 100us, 2ms}, {2ms, 1s, 4ms, 100us, 0ms});
  ASSERT_OK(joined);
  const CameraTiming timing = (*joined)->timing();
  EXPECT_EQ(timing.min_exposure, 2ms);
  EXPECT_EQ(timing.max_exposure, 1s);
  EXPECT_EQ(timing.readout, 5ms);
  EXPECT_EQ(timing.trigger_delay, 100us);
  EXPECT_EQ(timing.readout - timing.overlap, 4ms);
}

// One trigger begins all exposures, and the board's stamps count for all cameras.
TEST(JoinedCameras, expose_at_one_time) {
  const auto joined = joined_cameras({1ms, 2s, 5ms, 100us}, {1ms, 2s, 5ms, 200us});
  ASSERT_FALSE(joined.ok());
  EXPECT_NE(joined.error().line().find("pair 2"), std::string::npos) << joined.error().line();
  EXPECT_NE(joined.error().line().find("TriggerDelay"), std::string::npos) << joined.error().line();
}

TEST(JoinedProjectors, have_one_pacing) {
  std::vector<std::unique_ptr<Projector>> screens;
  screens.push_back(std::make_unique<ToldScreen>(std::make_shared<ToldScreen::State>()));
  screens.push_back(std::make_unique<ToldScreen>(std::make_shared<ToldScreen::State>(), Pacing::trigger));
  const auto joined = join_projectors(std::move(screens), {{1, 2}, {2, 6}});
  ASSERT_FALSE(joined.ok());
  EXPECT_EQ(joined.error().code, ErrorCode::bad_argument);
}

}  // namespace
}  // namespace symrig::pairs_test
