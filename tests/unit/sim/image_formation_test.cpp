// SPDX-License-Identifier: Apache-2.0

#include "sim/image_formation.hpp"

#include "sim/rig_profiles.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::sim::camera_optics_test {

namespace {

TEST(Shift, moves_a_picture_by_whole_and_part_pixels) {
  Image<float> picture({5, 6});
  picture.at(2, 3) = 1;
  Image<float> whole = picture;
  shift(whole.grid(), 1, whole.plane(0));
  EXPECT_EQ(whole.at(1, 2), 1.F);
  Image<float> part = picture;
  shift(part.grid(), 0.25, part.plane(0));  // samples at 2.25 see three quarters of pixel 2
  EXPECT_FLOAT_EQ(part.at(2, 3), 0.75F * 0.75F);
  EXPECT_FLOAT_EQ(part.at(1, 2), 0.25F * 0.25F);
  EXPECT_FLOAT_EQ(part.at(1, 3), 0.25F * 0.75F);
  Image<float> back = picture;
  shift(back.grid(), -0.5, back.plane(0));
  EXPECT_FLOAT_EQ(back.at(3, 4), 0.25F);
}

TEST(Flare, spreads_to_one_side_and_adds_no_light) {
  Image<float> picture({40, 30});
  picture.at(10, 8) = 1;
  add_flare(picture.grid(), 0.2, picture.plane(0));
  const double total = std::accumulate(picture.values().begin(), picture.values().end(), 0.0);
  EXPECT_LE(total, 1 + 1e-6);
  EXPECT_GT(total, 0.95);
  EXPECT_NEAR(picture.at(10, 8), 0.8 + 0.2 * std::pow(1 - std::exp(-0.25), 2), 1e-6);
  EXPECT_GT(picture.at(12, 9), 0);
  EXPECT_EQ(picture.at(9, 8), 0);
  EXPECT_EQ(picture.at(10, 7), 0);
}

// Binomial: 5 sigmas of 40,000 draws at 1 %.
TEST(DeadPixels, have_the_share_asked_for) {
  const auto dead = dead_pixels({200, 200}, 0.01, 3);
  const int count = std::accumulate(dead.values().begin(), dead.values().end(), 0);
  EXPECT_NEAR(count, 400, 5 * std::sqrt(400 * 0.99));
  EXPECT_EQ(dead, dead_pixels({200, 200}, 0.01, 3));
  EXPECT_NE(dead, dead_pixels({200, 200}, 0.01, 4));
  EXPECT_TRUE(dead_pixels({200, 200}, 0, 3).empty());
}

}  // namespace

}  // namespace symrig::sim::camera_optics_test

namespace symrig::sim::sensor_test {

namespace {

Sensor sensor(std::uint64_t seed = 1) {
  return {NoiseModel::from_electrons({}), 1e6, seed};
}

std::vector<std::uint16_t> expose(const Sensor& s, std::size_t pixels, double electrons,
                                  std::uint64_t frame) {
  const std::vector<float> radiance(pixels, static_cast<float>(electrons / 1e4));  // 10 ms at 1e6 e-/s
  std::vector<std::uint16_t> codes(pixels, 0xffff);
  s.expose(radiance, 0.01, frame, codes);
  return codes;
}

// Mean and variance against the noise model over 200,000 pixels: the mean has a sigma of σ/√n, the variance
// one of about σ² √(2/n); 5 sigmas each.
TEST(Sensor, follows_its_noise_model) {
  constexpr double kPixels = 200'000;
  const Sensor s = sensor();
  const double gain = s.noise.gain();
  for (const double electrons : {0.0, 3.0, 40.0, 60.0, 700.0, 15'000.0}) {
    const auto codes = expose(s, static_cast<std::size_t>(kPixels), electrons, 5);
    double sum = 0, squares = 0;
    for (const auto code : codes) sum += code;
    const double mean = sum / kPixels;
    for (const auto code : codes) squares += (code - mean) * (code - mean);
    const double expected = gain * gain * s.noise.variance(electrons);
    EXPECT_NEAR(mean, s.noise.pedestal() + gain * electrons, 5 * std::sqrt(expected / kPixels)) << electrons;
    EXPECT_NEAR(squares / kPixels / expected, 1, 5 * std::sqrt(2 / kPixels) + 0.002) << electrons;
  }
}

// A full well is the largest code; read noise of 1.2 DN moves it a little. Nothing wraps.
TEST(Sensor, saturates) {
  const Sensor s = sensor();
  for (const double electrons : {40'000.0, 1e9}) {
    for (const auto code : expose(s, 2000, electrons, 1)) {
      ASSERT_LE(code, s.noise.max_code());
      ASSERT_GE(code, s.noise.saturation_code());
    }
  }
}

TEST(Sensor, draws_by_seed_frame_and_pixel_alone) {
  const auto codes = expose(sensor(), 500, 300, 9);
  EXPECT_EQ(codes, expose(sensor(), 500, 300, 9));
  EXPECT_NE(codes, expose(sensor(), 500, 300, 10));
  EXPECT_NE(codes, expose(sensor(2), 500, 300, 9));
  const auto longer = expose(sensor(), 800, 300, 9);
  EXPECT_TRUE(std::equal(codes.begin(), codes.end(), longer.begin()));
}

// Neighbouring pixels and successive frames must not be correlated: |r| ≤ 5/√n.
TEST(Sensor, draws_independently) {
  constexpr std::size_t n = 100'000;
  const auto a = expose(sensor(), n, 100, 1);
  const auto b = expose(sensor(), n, 100, 2);
  const double mean = sensor().noise.pedestal() + sensor().noise.gain() * 100;
  double aa = 0, neighbour = 0, frame = 0;
  for (std::size_t i = 1; i < n; ++i) {
    aa += (a[i] - mean) * (a[i] - mean);
    neighbour += (a[i] - mean) * (a[i - 1] - mean);
    frame += (a[i] - mean) * (b[i] - mean);
  }
  EXPECT_LE(std::abs(neighbour / aa), 5 / std::sqrt(double(n)));
  EXPECT_LE(std::abs(frame / aa), 5 / std::sqrt(double(n)));
}

}  // namespace

}  // namespace symrig::sim::sensor_test

namespace symrig::sim::rig_profiles_test {

namespace {

struct Spent {
  ProbeCost cost;
  RigTime time;
  std::vector<Nanoseconds> exposures;
};

/// Ten photographs of a lit plane.
Spent ten_photographs(const std::string& profile, const std::string& keys = "") {
  auto rig = open_virtual_rig(fmt::format("sim:plane?size=16x16&exposures=4&profile={}{}", profile, keys));
  EXPECT_TRUE(rig.ok());
  const ProbeCost before = (*rig)->cost();
  const RigTime opened = (*rig)->rig().time();
  const std::vector<Pattern> patterns(10, Pattern((*rig)->grid(), 1, 1.F));
  EXPECT_TRUE((*rig)->measure(patterns).ok());
  ProbeCost cost = (*rig)->cost();
  cost.frames -= before.frames;
  cost.rig_seconds -= before.rig_seconds;
  RigTime time = (*rig)->rig().time();
  time.light -= opened.light, time.camera -= opened.camera, time.projector -= opened.projector;
  const auto exposures = (*rig)->rig().exposures();
  return {cost, time, {exposures.begin(), exposures.end()}};
}

double sum(const std::vector<Nanoseconds>& exposures) {
  double total = 0;
  for (const Nanoseconds one : exposures) total += seconds(one);
  return total;
}

class EveryProfile : public testing::TestWithParam<std::string> {};

std::vector<std::string> names() {
  std::vector<std::string> all;
  all.reserve(rig_profiles().size());
  for (const RigProfile& one : rig_profiles()) all.emplace_back(one.name);
  return all;
}

INSTANTIATE_TEST_SUITE_P(Profiles, EveryProfile, testing::ValuesIn(names()));

TEST_P(EveryProfile, splits_all_of_the_time) {
  const Spent spent = ten_photographs(GetParam());
  EXPECT_NEAR(spent.time.light + spent.time.camera + spent.time.projector, spent.cost.rig_seconds,
              1e-6 * spent.cost.rig_seconds);
  EXPECT_GT(spent.time.projector, 0);
}

// Ten brackets, and the reference before them: the board's pulses are the exposures, to the tick.
TEST_P(EveryProfile, counts_the_exposures_as_light) {
  const Spent spent = ten_photographs(GetParam());
  const double brackets =
      static_cast<double>(spent.cost.frames) / static_cast<double>(spent.exposures.size());
  SceneUri uri;
  uri.profile = GetParam();
  // Between the last plane and the next refresh it is dark: 1.5 % of the shutter's time of long exposures.
  const double dark = profile_of(uri).planes > 0 ? 1 - 24 * 684e-6 * 60 : 0;
  EXPECT_NEAR(spent.time.light, brackets * sum(spent.exposures), (1e-4 + dark) * spent.time.light + 1e-6);
}

// After each frame but the last of a run, the camera reads out. With overlap, some of it is in the next
// exposure.
TEST_P(EveryProfile, counts_the_readout_as_the_cameras) {
  const Spent spent = ten_photographs(GetParam());
  SceneUri uri;
  uri.profile = GetParam();
  const double readout = profile_of(uri).readout_seconds;
  const double runs = 3;  // of one reference and ten photographs
  const auto frames = static_cast<double>(spent.cost.frames);
  EXPECT_LE(spent.time.camera, frames * readout * (1 + 1e-6));
  const double overlapped = profile_of(uri).overlap ? spent.time.light : 0;
  EXPECT_GE(spent.time.camera + overlapped, (frames - runs) * readout * (1 - 1e-6));
}

TEST(RigProfiles, the_standard_is_what_a_rig_is_without_a_profile) {
  const RigSetup setup = setup_of(profile_of({})), standard = default_rig_setup();
  EXPECT_EQ(setup.camera.readout, standard.camera.readout);
  EXPECT_EQ(setup.projector.refresh, standard.projector.refresh);
  EXPECT_EQ(setup.projector.settle, standard.projector.settle);
  EXPECT_EQ(setup.projector.vsync_timeout, standard.projector.vsync_timeout);
}

// A tenth of the light, ten times the exposures: the same electrons, so the same photographs.
TEST(RigProfiles, dim_needs_ten_times_the_light_time_of_screen60) {
  const Spent screen = ten_photographs("screen60"), dim = ten_photographs("dim");
  EXPECT_NEAR(dim.time.light, 10 * screen.time.light, 0.1 * dim.time.light);
  EXPECT_NEAR(ten_photographs("screen60", "&light=0.1").time.light, dim.time.light, 1e-6 * dim.time.light);
}

// A pattern waits for a refresh of 0.7 ms, and one more passes until the pulse that asks for it has ended. A
// frame takes 5 ms instead of 16.7 ms.
TEST(RigProfiles, video_waits_less) {
  const Spent screen = ten_photographs("screen60"), video = ten_photographs("video");
  EXPECT_LT(video.time.projector, 11 * 2.0 / 1440);  // ten patterns and a reference
  EXPECT_LT(video.time.projector, 0.5 * screen.time.projector);
  EXPECT_NEAR(video.time.camera, 0.3 * screen.time.camera, 0.01 * screen.time.camera);
}

TEST(RigProfiles, an_unknown_one_is_refused) {
  const auto uri = parse_scene_uri("sim:plane?profile=cinema");
  ASSERT_FALSE(uri.ok());
  EXPECT_EQ(uri.error().code, ErrorCode::bad_argument);
  EXPECT_NE(uri.error().line().find("video"), std::string::npos);
}

TEST(RigProfiles, are_part_of_the_rigs_name) {
  const auto uri = parse_scene_uri("sim:plane?profile=video");
  ASSERT_TRUE(uri.ok());
  EXPECT_EQ(uri->to_string(), "sim:plane?size=128x128&profile=video");
}

}  // namespace

}  // namespace symrig::sim::rig_profiles_test
