// SPDX-License-Identifier: Apache-2.0
// Programs for the bit planes of a picture, run on a simulated board in front of a projector that shows
// planes.
#include "assert_ok.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/program/timeline.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::planes_test {
namespace {

using namespace std::chrono_literals;

/// A rig file's setup for planes.
RigSetup plane_setup() {
  RigSetup rig = default_rig_setup().without(RigRole::projector);
  rig.projector.sync = PatternSync::plane;
  rig.projector.planes = 24;
  rig.projector.plane_period = 684us;
  rig.projector.frame_lead = 20us;
  rig.projector.settle = 10us;
  RigLine plane;
  plane.config.line = "plane_trigger";
  plane.role = RigRole::plane;
  rig.lines.push_back(plane);
  return rig;
}

board_sim::SimBoardConfig with_plane_line() {
  board_sim::SimBoardConfig config;
  config.lines.push_back({"plane_trigger", false});
  return config;
}

class Planes : public ::testing::Test {
 protected:
  Planes() {
    sim.attach(projector);
    sim.attach(camera);
  }
  std::string error_of(const std::vector<PlaneExposure>& exposures) {
    auto board = Board::connect(make_sim_link(sim));
    const auto compiled = compile_planes(rig, board->info(), exposures);
    return compiled ? "" : compiled.error().line();
  }

  board_sim::SimBoard sim{with_plane_line()};
  board_sim::SimPlaneProjector projector{sim};
  board_sim::SimCamera camera{sim};
  RigSetup rig = plane_setup();
};

TEST_F(Planes, each_exposure_sees_its_plane_and_no_other) {
  projector.show(3, sim);
  auto board = Board::connect(make_sim_link(sim));
  ASSERT_OK(board);
  ASSERT_OK(board->configure({}));
  const std::vector<PlaneExposure> exposures{{0, 0, 1, 600us}, {0, 8, 1, 50us},  {0, 20, 4, 2700us},
                                             {1, 7, 10, 6ms},  {4, 1, 1, 670us}, {4, 9, 1, 20us}};
  const auto compiled = compile_planes(rig, board->info(), exposures);
  ASSERT_OK(compiled);
  // A rig splits its exposures into runs by this bound (host/src/rig/plane_brackets.cpp).
  EXPECT_LE(compiled->program.records(), 12 * exposures.size());
  const auto receipt = board->run(compiled->program, 10s);
  ASSERT_OK(receipt);
  EXPECT_TRUE(receipt->clean());
  ASSERT_EQ(camera.frames().size(), exposures.size());
  for (std::size_t i = 0; i < exposures.size(); ++i) {
    const auto& frame = camera.frames()[i];
    const PlaneExposure& wanted = exposures[i];
    EXPECT_EQ(frame.end - frame.begin, board->info().rate.ticks(wanted.exposure).count);
    const auto lit = projector.lit(frame.begin, frame.end);
    ASSERT_FALSE(lit.empty()) << i << " begin " << static_cast<double>(frame.begin) / 125e6 * 60;
    std::uint64_t bright = 0;
    for (const auto& one : lit) {
      EXPECT_EQ(one.picture, 3);
      EXPECT_GE(one.plane, wanted.plane) << i;
      EXPECT_LT(one.plane, wanted.plane + wanted.planes) << i;
      bright += one.ticks;
    }
    EXPECT_EQ(bright, frame.end - frame.begin) << "it was never dark";
  }
  // All in five refreshes, and the wait for the first one.
  EXPECT_LT(receipt->duration(), 6 * 16'666'667ns);
}

// The camera exposes 250 us after its trigger. The projector has settled long before.
TEST_F(Planes, a_late_camera_exposes_in_its_planes_too) {
  camera.set_trigger(250, false, sim);
  rig.camera.trigger_delay = 250us;
  projector.show(3, sim);
  auto board = Board::connect(make_sim_link(sim));
  ASSERT_OK(board);
  ASSERT_OK(board->configure({}));
  const std::vector<PlaneExposure> exposures{
      {0, 0, 1, 400us}, {0, 8, 1, 50us}, {0, 20, 4, 2400us}, {1, 7, 10, 6ms}};
  const auto compiled = compile_planes(rig, board->info(), exposures);
  ASSERT_OK(compiled);
  const auto receipt = board->run(compiled->program, 10s);
  ASSERT_OK(receipt);
  ASSERT_EQ(camera.frames().size(), exposures.size());
  for (std::size_t i = 0; i < exposures.size(); ++i) {
    const auto& frame = camera.frames()[i];
    EXPECT_EQ(frame.end - frame.begin, board->info().rate.ticks(exposures[i].exposure).count);
    for (const auto& one : projector.lit(frame.begin, frame.end)) {
      EXPECT_GE(one.plane, exposures[i].plane) << i;
      EXPECT_LT(one.plane, exposures[i].plane + exposures[i].planes) << i;
    }
  }
  EXPECT_NE(error_of({{0, 0, 1, 500us}}), "") << "the exposure would end in the next plane";
}

// A board whose edges software makes answers an edge hundreds of microseconds later. Each wait must still
// begin before its own edge, and after the one of the plane before.
TEST_F(Planes, a_board_that_answers_edges_late_waits_for_the_same_ones) {
  auto board = Board::connect(make_sim_link(sim));
  ASSERT_OK(board);
  BoardInfo slow = board->info();
  const TickRate rate = slow.rate;
  slow.wait_latency = rate.ticks(300us);
  const std::vector<PlaneExposure> exposures{
      {0, 2, 2, 300us}, {0, 12, 4, 2ms}, {1, 3, 26, 17ms}, {3, 1, 2, 50us}};
  const auto compiled = compile_planes(rig, slow, exposures);
  ASSERT_OK(compiled);
  const Nanoseconds first_frame = 5ms;
  const auto due = [&](const PlaneExposure& one) {
    return first_frame + one.refresh * rig.projector.refresh + rig.projector.frame_lead +
           one.plane * rig.projector.plane_period;
  };
  const int frame_line = slow.line(rig.line_name(RigRole::vsync));
  TimelineOptions options;
  options.edge_at = [&](const PlannedWait& wait) -> std::optional<Ticks> {
    if (wait.line == frame_line) return rate.ticks(first_frame);
    for (std::int64_t refresh = 0; refresh < 5; ++refresh)
      for (int plane = 0; plane < rig.projector.planes; ++plane)
        if (const Ticks edge = rate.ticks(due({refresh, plane, 1, {}})); edge >= wait.begin) return edge;
    return {};
  };
  const auto timeline = expand(compiled->program, slow, options);
  ASSERT_OK(timeline);
  const int camera_line = slow.line(rig.line_name(RigRole::camera));
  std::vector<Ticks> begins;
  for (const PlannedEdge& edge : timeline->edges)
    if (edge.line == camera_line && edge.level) begins.push_back(edge.tick);
  ASSERT_EQ(begins.size(), exposures.size());
  for (std::size_t i = 0; i < exposures.size(); ++i) {
    const Nanoseconds wanted = due(exposures[i]) + 300us + rig.projector.settle;
    // Ticks of 8 ns: each of the three times is rounded once.
    EXPECT_NEAR(static_cast<double>((rate.nanoseconds(begins[i]) - wanted).count()), 0, 24) << i;
  }
  for (const WaitOutcome& wait : timeline->waits) EXPECT_FALSE(wait.timed_out);
}

TEST_F(Planes, a_lost_edge_delays_one_exposure_and_ends_no_run) {
  projector.show(0, sim);
  auto board = Board::connect(make_sim_link(sim));
  ASSERT_OK(board);
  ASSERT_OK(board->configure({}));
  const auto compiled =
      compile_planes(rig, board->info(), std::vector<PlaneExposure>{{0, 3, 1, 100us}, {1, 3, 1, 100us}});
  ASSERT_OK(compiled);
  const std::uint64_t next = projector.refreshes() + 1;
  projector.faults.planes = {{next, 3}};
  const auto receipt = board->run(compiled->program, 10s);
  ASSERT_OK(receipt);
  EXPECT_EQ(receipt->end, RunEnd::completed);
  ASSERT_EQ(camera.frames().size(), 2U);
  EXPECT_EQ(projector.lit(camera.frames()[1].begin, camera.frames()[1].end).at(0).plane, 3);
}

TEST_F(Planes, exposures_that_do_not_fit_are_refused_by_name) {
  EXPECT_EQ(error_of({{0, 0, 1, 674us}}), "");
  EXPECT_EQ(
      error_of({{0, 0, 1, 675us}}),
      "an exposure of 675 us does not fit into 1 planes of 684 us; the nearest legal choice: at most 674 us");
  EXPECT_EQ(error_of({{0, 23, 1, 100us}}), "");
  EXPECT_EQ(error_of({{0, 23, 2, 1500us}}), "") << "it goes on in the next refresh";
  // Two planes, 250.667 us of dark time between refreshes, and 10 us to settle.
  EXPECT_NE(error_of({{0, 23, 2, 1609us}}).find("at most 1.608667 ms"), std::string::npos)
      << error_of({{0, 23, 2, 1609us}});
  EXPECT_NE(error_of({{0, 24, 1, 100us}}).find("do not begin in a picture of 24"), std::string::npos);
  rig.projector.plane_period = 700us;
  EXPECT_NE(error_of({{0, 0, 1, 100us}}).find("24 planes of 700 us do not fit"), std::string::npos);
  rig = plane_setup().without(RigRole::plane);
  EXPECT_NE(error_of({{0, 0, 1, 100us}}).find("no line has the role \"plane\""), std::string::npos);
  EXPECT_EQ(error_of({}), "there are no photographs to take");
}

}  // namespace
}  // namespace symrig::planes_test
