// SPDX-License-Identifier: Apache-2.0
// Whole rigs in virtual time whose projector shows bit planes: real firmware, pictures that are really split
// into planes, real noise, and triggers, cameras and controllers that misbehave.
#include "assert_ok.hpp"
#include "faulty_devices.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <cmath>
#include <cstdlib>
#include <memory>

#include <gtest/gtest.h>

namespace symrig::plane_rig_test {
namespace {
using namespace probe_laws;  // NOLINT(google-build-using-namespace)

using board_sim::SimPlaneProjector;
using test::CameraMischief;
using test::FaultyCamera;
using test::FaultyProjector;
using test::misfit;
using test::ProjectorMischief;

constexpr const char* kPlanes = "sim:vgroove-textured?size=24x32&exposures=2&ratio=4&profile=dlpc350";
constexpr const char* kExactPlanes = "sim:vgroove-textured?size=24x32&noise=off&profile=dlpc350";

struct PlaneBench {
  std::shared_ptr<CameraMischief> camera = std::make_shared<CameraMischief>();
  std::shared_ptr<ProjectorMischief> projector = std::make_shared<ProjectorMischief>();
  std::function<void(RigOptions&)> options;
  SimPlaneProjector* planes = nullptr;
  board_sim::SimBoard* board = nullptr;

  std::unique_ptr<VirtualRig> open(const std::string& uri) {
    auto rig = try_open(uri);
    EXPECT_TRUE(rig.ok()) << (rig.ok() ? "" : rig.error().line());
    return rig.ok() ? *std::move(rig) : nullptr;
  }
  Result<std::unique_ptr<VirtualRig>> try_open(const std::string& uri) {
    VirtualRigHooks hooks;
    hooks.camera = [this](Camera& inner) { return FaultyCamera::open(inner, camera); };
    hooks.projector = [this](Projector& inner) -> Result<std::unique_ptr<Projector>> {
      planes->go_on();
      return FaultyProjector::open(inner, projector);
    };
    hooks.planes = [this](SimPlaneProjector& raster, board_sim::SimBoard& sim) {
      planes = &raster;
      board = &sim;
    };
    hooks.options = [this](RigOptions& set) {
      set.ledger.guards = 4;
      set.headroom = 16;  // short exposures: patterns share pictures
      set.pause = [](Nanoseconds) {};
      if (options) options(set);
    };
    return open_virtual_rig(uri, hooks);
  }
  /// In the next `count` refreshes, this share of the pictures comes late.
  void be_late(std::uint64_t count, double flips) const {
    Random random(12);
    for (std::uint64_t refresh = planes->refreshes(); refresh < planes->refreshes() + count; ++refresh)
      if (random.uniform() < flips) planes->faults.flips.insert(refresh);
  }
  /// In the next `count` refreshes, edges of both trigger outputs are lost, and there are edges that are
  /// none.
  void lose_edges(std::uint64_t count, double frames, double edges, double glitches) const {
    Random random(11);
    for (std::uint64_t refresh = planes->refreshes(); refresh < planes->refreshes() + count; ++refresh) {
      if (random.uniform() < frames) planes->faults.frames.insert(refresh);
      for (int k = 0; k < 24; ++k)
        if (random.uniform() < edges) planes->faults.planes.insert({refresh, k});
      for (int k = 0; k < 24; ++k)
        if (random.uniform() < glitches) planes->faults.glitches.insert({refresh, k});
    }
  }
};

std::vector<Pattern> distinct_planes(Grid grid, int count) {
  return test::distinct_patterns(grid, count, 5000);
}

/// How many photographs are of another pattern.
int wrong_photographs(VirtualRig& rig, const std::vector<Pattern>& patterns) {
  const auto photographs = rig.measure(patterns);
  EXPECT_TRUE(photographs.ok()) << (photographs.ok() ? "" : photographs.error().line());
  if (!photographs) return static_cast<int>(patterns.size());
  int wrong = 0;
  for (std::size_t i = 0; i < patterns.size(); ++i)
    wrong += misfit(rig, patterns[i], (*photographs)[i]) > 1.6;
  return wrong;
}

TEST(PlaneRig, photographs_are_those_of_a_rig_with_whole_pictures) {
  const auto planes = open_virtual_rig(kExactPlanes);
  const auto whole = open_virtual_rig("sim:vgroove-textured?size=24x32&noise=off");
  ASSERT_OK(planes);
  ASSERT_OK(whole);
  const auto patterns = distinct_planes((*whole)->grid(), 100);
  const auto seen = (*planes)->measure(patterns), wanted = (*whole)->measure(patterns);
  ASSERT_OK(seen);
  ASSERT_OK(wanted);
  // The light of an exposure is a sum of shares of its planes: a few roundings of a float.
  for (std::size_t i = 0; i < patterns.size(); ++i)
    for (std::size_t k = 0; k < (*seen)[i].mean.values().size(); ++k)
      ASSERT_NEAR((*seen)[i].mean.values()[k], (*wanted)[i].mean.values()[k], 8 * 0x1p-24) << i;
}

TEST(PlaneRig, a_capture_ends_with_the_errors_of_a_rig_with_whole_pictures) {
  const auto errors = [](const char* profile) {
    auto rig = open_virtual_rig(std::string("sim:vgroove-textured?size=32x32&profile=") + profile);
    EXPECT_TRUE(rig.ok());
    auto done = capture(**rig, {});
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().line());
    const Scene& truth = (*rig)->truth();
    return evaluate(done->tensor, [&truth](const Image<float>& light) -> Result<Image<float>> {
      return truth.apply(light);
    });
  };
  const auto planes = errors("dlpc350"), whole = errors("standard");
  ASSERT_OK(planes);
  ASSERT_OK(whole);
  EXPECT_LT(planes->frobenius, 1.3 * whole->frobenius);
  EXPECT_LT(planes->indirect, 1.3 * whole->indirect);
}

// 10,000 exposures in planes with SYMRIG_LONG. 1 % of the plane edges and 2 % of the frame edges do not
// arrive, 1 % of the planes have an edge too early, 3 % of the pictures come a refresh late, and a quarter of
// the frames have something wrong with them.
TEST(PlaneRig, no_plane_is_taken_for_another) {
  PlaneBench bench;
  bench.options = [](RigOptions& options) { options.retakes = 60; };
  const auto rig = bench.open(kPlanes);
  ASSERT_NE(rig, nullptr);
  bench.lose_edges(100'000, 0.02, 0.01, 0.01);
  bench.be_late(100'000, 0.03);
  CameraMischief& camera = *bench.camera;
  camera.lost = camera.lost_unnoticed = camera.copied = camera.renumbered = 0.03;
  camera.late_stamp = camera.late_arrival = camera.damaged = 0.04;
  const int count = std::getenv("SYMRIG_LONG") != nullptr ? 5000 : 200;
  const std::int64_t before = rig->cost().frames;
  EXPECT_EQ(wrong_photographs(*rig, distinct_planes(rig->grid(), count)), 0);
  EXPECT_GE(rig->cost().frames - before, 2 * count);
  const RigTrouble& trouble = rig->rig().trouble();
  EXPECT_GT(trouble.planes_doubtful, 0);
  EXPECT_GT(trouble.patterns_late, 0);
  EXPECT_GT(trouble.retaken, 0);
  EXPECT_GT(trouble.frames.missing, 0);
}

TEST(PlaneRig, the_test_would_notice_a_wrong_plane) {
  PlaneBench bench;
  const auto rig = bench.open(kPlanes);
  ASSERT_NE(rig, nullptr);
  const auto patterns = distinct_planes(rig->grid(), 2);
  const auto photographs = rig->measure(patterns);
  ASSERT_OK(photographs);
  EXPECT_LT(misfit(*rig, patterns[0], (*photographs)[0]), 1.6);
  EXPECT_GT(misfit(*rig, patterns[1], (*photographs)[0]), 100);
}

// An edge that comes too early lets an exposure begin in the plane before. Only the proof finds it.
TEST(PlaneRig, exposures_that_begin_at_a_wrong_edge_are_found) {
  PlaneBench bench;
  bench.options = [](RigOptions& options) { options.retakes = 60; };
  const auto rig = bench.open(kPlanes);
  ASSERT_NE(rig, nullptr);
  const auto patterns = distinct_planes(rig->grid(), 24);
  EXPECT_EQ(wrong_photographs(*rig, patterns), 0);
  EXPECT_EQ(rig->rig().trouble().planes_doubtful, 0);
  EXPECT_EQ(rig->rig().trouble().retaken, 0);
  bench.lose_edges(10'000, 0, 0, 0.05);
  EXPECT_EQ(wrong_photographs(*rig, patterns), 0);
  EXPECT_GT(rig->rig().trouble().planes_doubtful, 0);
}

TEST(PlaneRig, exposures_of_a_late_picture_are_taken_again) {
  PlaneBench bench;
  const auto rig = bench.open(kPlanes);
  ASSERT_NE(rig, nullptr);
  bench.be_late(10'000, 0.1);
  EXPECT_EQ(wrong_photographs(*rig, distinct_planes(rig->grid(), 60)), 0);
  const RigTrouble& trouble = rig->rig().trouble();
  EXPECT_GT(trouble.patterns_late, 0);
  EXPECT_GT(trouble.planes_doubtful, 0);
  EXPECT_GT(trouble.retaken, 0);
}

// A computer that is late in every second refresh would never show the planned picture. It gets more time for
// each.
TEST(PlaneRig, a_slow_screen_holds_its_pictures_longer) {
  PlaneBench bench;
  bench.options = [](RigOptions& options) { options.retakes = 20; };
  const auto rig = bench.open(kPlanes);
  ASSERT_NE(rig, nullptr);
  for (std::uint64_t refresh = 0; refresh < 100'000; refresh += 2) bench.planes->faults.flips.insert(refresh);
  EXPECT_EQ(wrong_photographs(*rig, distinct_planes(rig->grid(), 60)), 0);
}

// Edges of all refreshes are alike, so they cannot tell that the screen's stamps are a refresh off, or that
// the controller takes a refresh more. Light can.
TEST(PlaneRig, planes_that_come_at_another_refresh_are_noticed_when_the_rig_is_opened) {
  for (const int refreshes : {-2, -1, 1, 2}) {
    PlaneBench bench;
    bench.projector->says_later = refreshes * Nanoseconds{16'666'667};
    const auto opened = bench.try_open(kPlanes);
    ASSERT_FALSE(opened.ok()) << refreshes;
    EXPECT_EQ(opened.error().code, ErrorCode::device_refused) << opened.error().line();
    EXPECT_NE(opened.error().line().find("set projector.latency"), std::string::npos)
        << opened.error().line();
  }
}

// Less than half a refresh leaves no doubt which one it is. From 3/8 on, nothing is taken for certain.
TEST(PlaneRig, stamps_that_fit_to_no_refresh_prove_nothing) {
  PlaneBench bench;
  const auto rig = bench.open(kPlanes);
  ASSERT_NE(rig, nullptr);
  const auto patterns = distinct_planes(rig->grid(), 30);
  bench.projector->says_later = Nanoseconds{5'000'000};
  EXPECT_EQ(wrong_photographs(*rig, patterns), 0);
  EXPECT_EQ(rig->rig().trouble().planes_doubtful, 0);
  bench.projector->says_later = Nanoseconds{7'000'000};
  const auto photographs = rig->measure(patterns);
  ASSERT_FALSE(photographs.ok());
  EXPECT_EQ(photographs.error().code, ErrorCode::frame_missing);
  EXPECT_NE(photographs.error().line().find("fits to no refresh"), std::string::npos)
      << photographs.error().line();
}

// A board that gets the request to start too late takes a run in vain. Then it gets more time.
TEST(PlaneRig, a_late_start_is_noticed) {
  PlaneBench bench;
  const auto rig = bench.open(kPlanes);
  ASSERT_NE(rig, nullptr);
  bench.projector->play_takes = Nanoseconds{45'000'000};
  bench.projector->wait = [&bench](Nanoseconds time) {
    const TickRate rate{bench.board->config().tick_hz};
    bench.board->advance_to(bench.board->now() + rate.ticks(time).count);
  };
  EXPECT_EQ(wrong_photographs(*rig, distinct_planes(rig->grid(), 30)), 0);
  EXPECT_GT(rig->rig().trouble().planes_doubtful, 0);
  const std::int64_t doubtful = rig->rig().trouble().planes_doubtful;
  EXPECT_EQ(wrong_photographs(*rig, distinct_planes(rig->grid(), 30)), 0);
  EXPECT_EQ(rig->rig().trouble().planes_doubtful, doubtful) << "now the first picture waits";
}

TEST(PlaneRig, a_controller_that_was_reset_is_opened_again) {
  PlaneBench bench;
  const auto rig = bench.open(kPlanes);
  ASSERT_NE(rig, nullptr);
  bench.projector->reset_at = bench.projector->shows + 3;
  bench.projector->on_reset = [&bench] { bench.planes->stop(bench.board->now()); };
  EXPECT_EQ(wrong_photographs(*rig, distinct_planes(rig->grid(), 60)), 0);
  EXPECT_EQ(rig->rig().trouble().projectors_reopened, 1);
}

// It comes back with two planes in each other's places: what it showed since then is no photograph.
TEST(PlaneRig, a_controller_that_comes_back_with_another_table_is_refused) {
  PlaneBench bench;
  const auto rig = bench.open(kPlanes);
  ASSERT_NE(rig, nullptr);
  bench.projector->reset_at = bench.projector->shows + 3;
  bench.projector->on_reset = [&bench] {
    bench.planes->stop(bench.board->now());
    for (int k = 0; k < 24; ++k) bench.planes->faults.order.push_back(k == 6 ? 7 : k == 7 ? 6 : k);
  };
  const auto photographs = rig->measure(distinct_planes(rig->grid(), 100));
  ASSERT_FALSE(photographs.ok());
  EXPECT_EQ(photographs.error().code, ErrorCode::device_refused);
  EXPECT_NE(photographs.error().line().find("in the place of plane 6 came plane 7"), std::string::npos)
      << photographs.error().line();
}

}  // namespace
}  // namespace symrig::plane_rig_test
