// SPDX-License-Identifier: Apache-2.0
// The key profile: timing and light of a simulated rig.
#include "sim/rig_profiles.hpp"

#include "symrig/sim/virtual_rig.hpp"

#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

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
