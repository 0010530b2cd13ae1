// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/rig.hpp"

#include "rig/exposure_choice.hpp"
#include "sim/simulated_devices.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/testing/camera_laws.hpp"
#include "symrig/testing/projector_laws.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>

namespace symrig::sim::rig_test {
namespace {

/// Four frames each, so that a test can count them.
RigOptions four_exposures() {
  RigOptions options;
  options.exposures = 4;
  return options;
}

using namespace std::chrono_literals;

TEST(PlanExposures, is_geometric_and_starts_at_what_is_wanted) {
  const auto plan = plan_exposures(2ms, 4, 8, {});
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(*plan, (std::vector<Nanoseconds>{2ms, 16ms, 128ms, 1024ms}));
}

TEST(PlanExposures, stays_within_what_the_camera_holds) {
  CameraTiming timing;
  timing.max_exposure = 1s;
  const auto plan = plan_exposures(100ms, 3, 10, timing);  // 10 s would be the third: all shrink together
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(*plan, (std::vector<Nanoseconds>{10ms, 100ms, 1000ms}));
  timing.min_exposure = 11ms;
  EXPECT_EQ(plan_exposures(100ms, 3, 10, timing).error().code, ErrorCode::limit);
  EXPECT_EQ(plan_exposures(1ms, 1, 10, timing).error().code, ErrorCode::limit);
}

// 4087 − 64 codes at 0.2016 DN/e⁻ are 19,960 e⁻; 1.25 below that at 1e6 e⁻/s.
TEST(ExposureFor, leaves_the_headroom) {
  const NoiseModel noise = NoiseModel::from_electrons({});
  const double electrons = (noise.saturation_code() - noise.pedestal()) / noise.gain();
  EXPECT_NEAR(seconds(exposure_for(1e6, 1.25, noise)), electrons / 1.25e6, 1e-9);
  EXPECT_GE(exposure_for(0, 1.25, noise), 1h);
}

/// A board with a projector and a camera that looks at a grey wall: rate electrons a second at full light.
class Wall {
 public:
  explicit Wall(double rate, const board_sim::SimCameraConfig& shutter = {}, Image<std::uint8_t> dead = {})
      : raster_(board_), shutter_(board_, shutter), rate_(rate), dead_(std::move(dead)) {
    board_.attach(raster_);
    board_.attach(shutter_);
  }

  Result<std::unique_ptr<Rig>> open(const RigOptions& options = four_exposures(), Grid camera = {3, 4}) {
    auto projector =
        std::make_unique<SimulatedProjector>(Grid{3, 4}, raster_, options.setup.projector.refresh);
    const SimulatedProjector* screen = projector.get();
    pixels_ = static_cast<std::size_t>(camera.size());
    SimulatedCameraSpec spec{camera, 1, timing, NoiseModel::from_electrons({}), dead_, 125'000'000};
    auto eye = std::make_unique<SimulatedCamera>(
        spec, shutter_, [this, screen](auto exposures) { return develop(*screen, exposures); });
    SYMRIG_TRY(auto board, Board::connect(make_sim_link(board_)));
    return Rig::open(std::move(board), std::move(projector), std::move(eye), options);
  }

  std::vector<double> open_seconds;  ///< of every exposure so far
  double lamp = 1;                   ///< its brightness
  CameraTiming timing;               ///< what the camera says of itself

 private:
  std::vector<CameraFrame> develop(const SimulatedProjector& screen,
                                   std::span<const SimulatedExposure> exposures) {
    const NoiseModel noise = NoiseModel::from_electrons({});
    std::vector<CameraFrame> frames;
    for (const SimulatedExposure& exposure : exposures) {
      const double open = static_cast<double>(exposure.end - exposure.begin) / 125e6;
      open_seconds.push_back(open);
      double light = 0;
      for (const auto& lit : screen.shown(exposure.begin, exposure.end))
        light += lit.share * screen.pattern(lit.index).at(0, 0);
      const double code = std::min(noise.pedestal() + noise.gain() * rate_ * lamp * light * open, 4095.0);
      CameraFrame frame;
      frame.sequence = exposure.sequence;
      frame.raw.assign(pixels_, static_cast<std::uint16_t>(std::lround(code)));
      if (!dead_.empty()) frame.raw[5] = 4095;
      frames.push_back(std::move(frame));
    }
    return frames;
  }

  board_sim::SimBoard board_;
  board_sim::SimProjector raster_;
  board_sim::SimCamera shutter_;
  double rate_;
  Image<std::uint8_t> dead_;
  std::size_t pixels_ = 0;
};

TEST(Laws, simulated_devices_keep_those_of_projectors_and_cameras) {
  board_sim::SimBoard board;
  board_sim::SimProjector raster(board);
  board_sim::SimCamera shutter(board);
  board.attach(raster);
  board.attach(shutter);
  SimulatedProjector projector(Grid{3, 4}, raster, 10ms);
  expect_projector_laws(projector);

  const NoiseModel noise = NoiseModel::from_electrons({});
  SimulatedCamera camera({{3, 4}, 1, {}, noise, {}, 125'000'000}, shutter, [](auto exposures) {
    std::vector<CameraFrame> frames;
    for (const SimulatedExposure& exposure : exposures) {
      frames.emplace_back();
      frames.back().sequence = exposure.sequence;
      frames.back().raw.assign(12, 100);
    }
    return frames;
  });
  auto host = Board::connect(make_sim_link(board));
  ASSERT_TRUE(host.ok());
  ASSERT_TRUE(host->configure({}).ok());
  expect_camera_laws(camera, [&host](std::size_t count) {
    const std::vector<Exposures> brackets(count, Exposures{1ms});
    const RigSetup blind = default_rig_setup().without(RigRole::projector).without(RigRole::vsync);
    const auto compiled = compile_brackets(blind, host->info(), brackets);
    ASSERT_TRUE(compiled.ok()) << compiled.error().line();
    EXPECT_TRUE(host->run(compiled->program, 10s).ok());
  });
}

// The wall fills the well in 10 ms: 19,960 e⁻ / 1.25 / 2e6 e⁻/s = 8 ms, known to 4 % from a frame that fills
// at least a sixth of the range (trial exposures are six times apart).
TEST(Rig, sets_its_exposures_by_the_flood_lit_scene) {
  Wall wall(2e6);
  const auto rig = wall.open();
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  const auto exposures = (*rig)->exposures();
  ASSERT_EQ(exposures.size(), 4U);
  EXPECT_NEAR(seconds(exposures[0]), 7.98e-3, 0.04 * 7.98e-3);
  for (std::size_t k = 1; k < 4; ++k) EXPECT_NEAR(seconds(exposures[k]), 8 * seconds(exposures[k - 1]), 8e-9);
}

// White that is made up in 2 ms: 7.98 ms become 6 ms, and so on; a wall that needs less than a period is
// refused, not photographed at whatever the wheel shows.
TEST(Rig, exposes_whole_periods_of_the_light) {
  RigOptions options = four_exposures();
  options.setup.projector.light_period = 2ms;
  Wall wall(2e6);
  const auto rig = wall.open(options);
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  for (const double open : wall.open_seconds) EXPECT_NEAR(open / 2e-3, std::round(open / 2e-3), 1e-5) << open;
  EXPECT_EQ((*rig)->exposures().front(), 6ms);
  Wall bright(1e7);  // 1.6 ms
  EXPECT_EQ(bright.open(options).error().code, ErrorCode::limit);
}

TEST(Rig, exposes_as_long_as_planned_to_a_tick) {
  Wall wall(2e6);
  const auto rig = wall.open();
  ASSERT_TRUE(rig.ok());
  wall.open_seconds.clear();
  ASSERT_TRUE((*rig)->measure(std::vector<Pattern>(3, Pattern({3, 4}, 1, 1.F))).ok());
  ASSERT_EQ(wall.open_seconds.size(), 16U);  // and four for the reference
  for (std::size_t i = 0; i < 16; ++i)
    EXPECT_NEAR(wall.open_seconds[i], seconds((*rig)->exposures()[i % 4]), 8.1e-9) << i;
}

// Quantisation of the shortest frame is 0.3 DN of 3,200: radiance in electrons per second, scaled by 1.
TEST(Rig, returns_radiance_per_unit_of_light) {
  Wall wall(2e6);
  const auto rig = wall.open();
  ASSERT_TRUE(rig.ok());
  const auto p = (*rig)->measure(std::vector<Pattern>{Pattern({3, 4}, 1, 1.F), Pattern({3, 4}, 1, 0.5F)});
  ASSERT_TRUE(p.ok()) << p.error().line();
  EXPECT_NEAR((*p)[0].mean.at(1, 1), 2e6, 2e6 * 1e-3);
  EXPECT_NEAR((*p)[1].mean.at(1, 1), 1e6, 1e6 * 1e-3);
}

TEST(Rig, meters_around_dead_pixels) {
  Image<std::uint8_t> dead({3, 4});
  dead.values()[5] = 1;
  Wall wall(2e6, {}, dead);
  const auto rig = wall.open();
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  EXPECT_NEAR(seconds((*rig)->exposures()[0]), 7.98e-3, 0.04 * 7.98e-3);
}

// Headroom below 1: the flood-lit wall saturates every frame. The pixels are invalid, never a wrong number;
// half the light is measured as ever.
TEST(Rig, marks_what_saturates_its_shortest_exposure) {
  Wall wall(2e6);
  RigOptions options = four_exposures();
  options.headroom = 0.8;
  const auto rig = wall.open(options);
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  const auto p = (*rig)->measure(std::vector<Pattern>{Pattern({3, 4}, 1, 1.F), Pattern({3, 4}, 1, 0.5F)});
  ASSERT_TRUE(p.ok()) << p.error().line();
  EXPECT_EQ((*p)[0].valid.at(1, 1), 0);
  EXPECT_EQ((*p)[0].mean.at(1, 1), 0);
  EXPECT_EQ((*p)[1].valid.at(1, 1), 1);
  EXPECT_NEAR((*p)[1].mean.at(1, 1), 1e6, 1e6 * 1e-3);
}

// References can be left out, and then nothing is divided by anything.
TEST(Rig, shows_no_reference_if_told_not_to) {
  Wall wall(2e6);
  RigOptions options = four_exposures();
  options.reference_every = 0;
  const auto rig = wall.open(options);
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  wall.open_seconds.clear();
  ASSERT_TRUE((*rig)->measure(std::vector<Pattern>(120, Pattern({3, 4}, 1, 1.F))).ok());
  EXPECT_EQ(wall.open_seconds.size(), 480U);
  EXPECT_EQ((*rig)->lamp().value, 1);
}

// Every 50 photographs at first; a wall that holds still is asked after 50, 100, 200 and then every 400.
TEST(Rig, asks_a_steady_lamp_more_and_more_rarely) {
  Wall wall(2e6);
  const auto rig = wall.open();
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  wall.open_seconds.clear();
  ASSERT_TRUE((*rig)->measure(std::vector<Pattern>(1'151, Pattern({3, 4}, 1, 1.F))).ok());
  EXPECT_EQ(wall.open_seconds.size(), 4 * (1'151 + 6U));  // at 0, 50, 150, 350, 750, 1150
  EXPECT_NEAR((*rig)->lamp().value, 1, 1e-6);
}

TEST(Rig, notices_that_the_lamp_went_out) {
  Wall wall(2e6);
  const auto rig = wall.open();
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  const std::vector<Pattern> patterns(30, Pattern({3, 4}, 1, 1.F));
  ASSERT_TRUE((*rig)->measure(patterns).ok());
  wall.lamp = 0;
  const auto dark = (*rig)->measure(patterns);  // the second reference is the 51st photograph
  ASSERT_FALSE(dark.ok());
  EXPECT_EQ(dark.error().code, ErrorCode::device_lost) << dark.error().line();
}

// The wall at 90 % of the light: the second reference says so, and the photographs after it are as they were.
// Codes are whole: 0.3 of 3,200 in the shortest frame, less in the sum of two references.
TEST(Rig, divides_by_the_level_of_the_lamp) {
  Wall wall(2e6);
  const auto rig = wall.open();
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  const Pattern flood({3, 4}, 1, 1.F);
  ASSERT_TRUE((*rig)->measure(std::vector<Pattern>(50, flood)).ok());
  wall.lamp = 0.9;
  const auto p = (*rig)->measure(std::vector<Pattern>{flood});
  ASSERT_TRUE(p.ok()) << p.error().line();
  EXPECT_NEAR((*rig)->lamp().value, 0.9, 1e-3);
  EXPECT_NEAR((*p)[0].mean.at(1, 1), 2e6, 2e6 * 2e-3);
}

TEST(Rig, refuses_a_scene_that_blinds_the_camera) {
  Wall wall(2e9);  // 20 µs, the shortest exposure, collect 40,000 e⁻
  const auto rig = wall.open();
  ASSERT_FALSE(rig.ok());
  EXPECT_EQ(rig.error().code, ErrorCode::limit) << rig.error().line();
}

// Patterns have the projector's grid, photographs the camera's. Only a capture needs one grid.
TEST(Rig, photographs_with_a_camera_that_has_a_grid_of_its_own) {
  Wall wall(2e6);
  const auto rig = wall.open({}, {6, 5});
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  EXPECT_EQ((*rig)->grid(), (Grid{3, 4}));
  EXPECT_EQ((*rig)->camera_grid(), (Grid{6, 5}));
  const Pattern flood({3, 4}, 1, 1.F);
  const auto photographs = (*rig)->measure({&flood, 1});
  ASSERT_TRUE(photographs.ok()) << photographs.error().line();
  EXPECT_EQ(photographs->front().mean.grid(), (Grid{6, 5}));
  const Error error = check_aligned(**rig).error();
  EXPECT_EQ(error.code, ErrorCode::size_mismatch);
  EXPECT_NE(error.line().find("symrig calibrate"), std::string::npos) << error.line();
}

// A camera that is still reading out when the next trigger comes: the ledger notices, nothing is merged.
TEST(Rig, gives_no_photograph_if_the_camera_missed_a_trigger) {
  board_sim::SimCameraConfig slow;
  slow.readout_us = 9'000;  // the profile allows 4 ms
  Wall wall(2e6, slow);
  const auto rig = wall.open();
  ASSERT_FALSE(rig.ok());
  EXPECT_EQ(rig.error().code, ErrorCode::frame_missing) << rig.error().line();
}

/// Photographs of two patterns in turn. With a pattern for another one, a radiance would be wrong by half or
/// more.
void expect_halves_and_wholes(Rig& rig) {
  std::vector<Pattern> patterns;
  patterns.reserve(6);
  for (int k = 0; k < 6; ++k) patterns.emplace_back(Grid{3, 4}, 1, k % 2 == 0 ? 1.F : 0.5F);
  const auto photographs = rig.measure(patterns);
  ASSERT_TRUE(photographs.ok()) << photographs.error().line();
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_NEAR((*photographs)[k].mean.at(1, 1), k % 2 == 0 ? 2e6 : 1e6, 2e3) << k;
  EXPECT_EQ(rig.trouble().retaken, 0);
  EXPECT_EQ(rig.trouble().frames.missing, 0);
}

// The camera exposes 7 ms after its trigger: longer than settling, and longer than the shortest exposure. Its
// stamps mark the end of exposures. Without a strobe, the rig knows them from the trigger and the delay only.
TEST(Rig, knows_exposures_that_begin_late) {
  board_sim::SimCameraConfig late;
  late.delay_us = 7'000;
  for (const bool strobed : {true, false}) {
    Wall wall(2e6, late);
    wall.timing.trigger_delay = 7ms;
    RigOptions options = four_exposures();
    options.ledger.guards = 4;
    if (!strobed) options.setup = options.setup.without(RigRole::strobe);
    const auto rig = wall.open(options);
    ASSERT_TRUE(rig.ok()) << rig.error().line();
    expect_halves_and_wholes(**rig);

    Wall untold(2e6, late);
    const auto other = untold.open(options);
    EXPECT_FALSE(other.ok() && (*other)->measure(std::vector<Pattern>(2, Pattern({3, 4}, 1, 1.F))).ok())
        << "the test sees the delay";
  }
}

// 8 ms and more of light, 6 ms of readout: a camera that overlaps loses no time between exposures.
TEST(Rig, overlaps_exposures_and_readouts_if_the_camera_does) {
  board_sim::SimCameraConfig shutter;
  shutter.readout_us = 6'000;
  const auto rig_seconds = [&shutter](Nanoseconds overlap) {
    Wall wall(2e6, shutter);
    wall.timing.readout = 6ms;
    wall.timing.overlap = overlap;
    RigOptions options = four_exposures();
    const auto rig = wall.open(options);
    EXPECT_TRUE(rig.ok()) << rig.error().line();
    if (!rig) return 0.0;
    expect_halves_and_wholes(**rig);
    return (*rig)->cost().rig_seconds;
  };
  const double apart = rig_seconds(0ms);
  shutter.overlap = true;
  EXPECT_LT(rig_seconds(6ms), apart);
  // A camera that only says it overlaps misses triggers, and the ledger knows.
  shutter.overlap = false;
  Wall wall(2e6, shutter);
  wall.timing.readout = wall.timing.overlap = 6ms;
  const auto rig = wall.open();
  ASSERT_FALSE(rig.ok());
  EXPECT_EQ(rig.error().code, ErrorCode::frame_missing) << rig.error().line();
}

// Exposures of 0.8 ms cannot outlast a readout of 6 ms that they begin in, so most of it is waited for.
TEST(Rig, a_short_exposure_ends_after_the_readout_that_it_overlaps) {
  board_sim::SimCameraConfig shutter;
  shutter.readout_us = 6'000;
  shutter.overlap = true;
  Wall wall(2e7, shutter);
  wall.timing.readout = wall.timing.overlap = 6ms;
  RigOptions options = four_exposures();
  options.exposures = 2;
  options.ratio = 2;
  const auto rig = wall.open(options);
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  EXPECT_LT((*rig)->exposures().front(), 1ms);
  const auto photographs = (*rig)->measure(std::vector<Pattern>(3, Pattern({3, 4}, 1, 1.F)));
  ASSERT_TRUE(photographs.ok()) << photographs.error().line();
  EXPECT_EQ((*rig)->trouble().retaken, 0);
}

// A rig file fixes the gap from the readout that it describes; the camera's own is longer.
TEST(Rig, lengthens_its_gap_by_the_readout_that_the_camera_states) {
  board_sim::SimCameraConfig slow;
  slow.readout_us = 9'000;
  Wall wall(2e6, slow);
  wall.timing.readout = 9ms;
  RigOptions options = four_exposures();
  options.gap = options.setup.camera.readout + 1ms;
  const auto rig = wall.open(options);
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  expect_halves_and_wholes(**rig);
}

TEST(Rig, fails_when_a_line_is_not_there) {
  Wall wall(2e6);
  RigOptions options = four_exposures();
  for (RigLine& line : options.setup.lines)
    if (line.role == RigRole::camera) line.config.line = "shutter";
  const auto rig = wall.open(options);
  ASSERT_FALSE(rig.ok());
  EXPECT_EQ(rig.error().code, ErrorCode::unknown_name) << rig.error().line();
}

}  // namespace
}  // namespace symrig::sim::rig_test
