// SPDX-License-Identifier: Apache-2.0
// Which exposure is taken in which plane of which picture.
// The check of bit planes with light, when a rig is opened: projectors that show the planes in another way
// than the rig file says.

#include "assert_ok.hpp"
#include "rig/planes.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <functional>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::plane_schedule_test {

namespace {

using namespace std::chrono_literals;

PlaneRules rules() {
  return {{24, 684us, 684us, 20us, 1}, 16'666'667ns, 10us, 5ms, 0us, 1, true};
}

Nanoseconds begin(const PlaneExposure& at, const PlaneRules& rule) {
  return at.refresh * rule.refresh + rule.timing.frame_lead + at.plane * rule.timing.period;
}

/// What every schedule keeps: each exposure once and in order, one after the other with the camera's gap and
/// in time for the wait for its edge, all of its light in planes with its own pattern, and no other light.
void expect_schedule(std::span<const WantedExposure> wanted, const PlaneRules& rule) {
  const auto planned = plan_planes(wanted, rule);
  ASSERT_OK(planned);
  ASSERT_EQ(planned->exposures.size(), wanted.size());
  const Nanoseconds period = rule.timing.period;
  Nanoseconds ready = rule.first;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto& [what, at] = planned->exposures[i];
    EXPECT_EQ(what.photograph, wanted[i].photograph);
    EXPECT_EQ(what.exposure, wanted[i].exposure);
    EXPECT_GE(begin(at, rule), ready - rule.overlap);
    EXPECT_GT(begin(at, rule) + what.time, ready) << "an exposure ends after the readout of the last one";
    for (const Nanoseconds delay : {Nanoseconds{0}, rule.reaction}) {
      const Nanoseconds open = begin(at, rule) + rule.settle + delay, closed = open + at.exposure;
      ready = closed + rule.gap + plane_lead(period);
      Nanoseconds light{0};
      for (std::size_t refresh = 0; refresh < planned->order.size(); ++refresh)
        for (int k = 0; k < rule.timing.planes; ++k) {
          const Nanoseconds from = begin({static_cast<std::int64_t>(refresh), k, 1, {}}, rule);
          const Nanoseconds lit = std::min(closed, from + period) - std::max(open, from);
          if (lit.count() <= 0) continue;
          EXPECT_EQ(planned->pattern(planned->order[refresh], k), static_cast<int>(what.photograph));
          light += lit;
        }
      EXPECT_EQ(light, what.time) << "the exposure goes on in the next picture for as long as it is dark";
    }
    if (!rule.may_cross()) {
      EXPECT_LE(at.plane + at.planes, rule.timing.planes);
    }
  }
  for (std::size_t refresh = 1; refresh < planned->order.size(); ++refresh)
    if (refresh % static_cast<std::size_t>(rule.hold) != 0) {
      EXPECT_EQ(planned->order[refresh], planned->order[refresh - 1]) << "a picture is held";
    }
}

TEST(PlaneSchedule, random_brackets_are_taken_once_each_in_their_planes) {
  Random random(3);
  for (int round = 0; round < 300; ++round) {
    PlaneRules rule = rules();
    rule.timing.planes = 1 + static_cast<int>(random.uniform() * 24);
    rule.gap = Nanoseconds{static_cast<std::int64_t>(random.uniform() * 30e6)};
    rule.overlap = round % 7 < 3 ? Nanoseconds{0} : rule.gap / (1 + round % 3);
    rule.hold = 1 + round % 3;
    rule.crosses = round % 2 == 0;
    rule.reaction = round % 5 == 4 ? 150us : 0us;
    rule.first = 3 * rule.reaction;
    const auto longest = longest_in_planes(rule);
    ASSERT_OK(longest);
    const double most = (rule.may_cross() ? 5.0 : 1.0) * static_cast<double>(longest->count() - 20'000);
    std::vector<WantedExposure> wanted;
    const auto photographs = static_cast<std::size_t>(1 + random.uniform() * 40);
    for (std::size_t i = 0; i < photographs; ++i)
      for (std::size_t j = 0; j < 1 + i % 4; ++j) {
        const double share = random.uniform() * random.uniform();
        wanted.push_back({i, j, Nanoseconds{20'000 + static_cast<std::int64_t>(share * most)}});
      }
    expect_schedule(wanted, rule);
  }
}

std::vector<WantedExposure> one_each(std::size_t photographs, Nanoseconds time) {
  std::vector<WantedExposure> wanted;
  for (std::size_t i = 0; i < photographs; ++i) wanted.push_back({i, 0, time});
  return wanted;
}

// A frame takes 0.3 ms of light, 5 ms of readout and a quarter of a plane for the wait: 8.2 planes, so 9.
TEST(PlaneSchedule, the_camera_sets_the_pace) {
  const auto planned = plan_planes(one_each(24, 300us), rules());
  ASSERT_OK(planned);
  for (std::size_t i = 1; i < 24; ++i) {
    const PlaneExposure &before = planned->exposures[i - 1].at, &at = planned->exposures[i].at;
    const std::int64_t planes = 24 * (at.refresh - before.refresh) + at.plane - before.plane;
    // The dark time between refreshes can save a plane.
    EXPECT_GE(planes, 8);
    EXPECT_LE(planes, 9);
  }
  EXPECT_EQ(planned->order.size(), 9U) << "another picture in each refresh";
  EXPECT_EQ(planned->pictures.size(), 9U);
}

// A frame takes 2 ms of light, 5 ms of readout and a quarter of a plane for the wait: 10.5 planes, so 11.
// With overlap: 7.6, so 8. With an overlap of 1 ms: 9.02, so 10, or 9 where the dark time saves one.
TEST(PlaneSchedule, a_camera_that_overlaps_waits_for_its_readout_only) {
  PlaneRules rule = rules();
  const auto refreshes = [&rule] { return plan_planes(one_each(48, 2ms), rule)->order.size(); };
  EXPECT_EQ(refreshes(), 48U * 11 / 24);
  rule.overlap = 5ms;
  EXPECT_EQ(refreshes(), 48U * 8 / 24);
  rule.overlap = 1ms;
  EXPECT_GE(refreshes(), 48U * 9 / 24);
  EXPECT_LE(refreshes(), 48U * 10 / 24);
}

TEST(PlaneSchedule, a_camera_as_fast_as_the_planes_takes_one_in_each) {
  PlaneRules rule = rules();
  rule.gap = 100us;
  const auto planned = plan_planes(one_each(48, 300us), rule);
  ASSERT_OK(planned);
  EXPECT_EQ(planned->order.size(), 2U);
  for (std::size_t i = 0; i < 48; ++i) EXPECT_EQ(planned->pattern(i / 24, static_cast<int>(i % 24)), int(i));
}

TEST(PlaneSchedule, a_bracket_repeats_the_planes_of_its_pattern) {
  PlaneRules rule = rules();
  rule.gap = 0us;
  const std::vector<WantedExposure> wanted{{0, 0, 100us}, {0, 1, 1600us}, {1, 0, 50us}};
  const auto planned = plan_planes(wanted, rule);
  ASSERT_OK(planned);
  ASSERT_EQ(planned->pictures.size(), 1U);
  const PlanePlan& plan = planned->pictures[0];
  EXPECT_EQ(PlanePlan(plan.begin(), plan.begin() + 5), (PlanePlan{0, 0, 0, 0, 1}));
  EXPECT_EQ(std::count(plan.begin(), plan.end(), kBlackPlane), 19);
}

TEST(PlaneSchedule, a_long_exposure_lasts_longer_by_the_dark_time_between_refreshes) {
  const PlaneRules rule = rules();
  const auto planned = plan_planes(std::vector<WantedExposure>{{0, 0, 40ms}, {1, 0, 1ms}}, rule);
  ASSERT_OK(planned);
  const PlaneExposure& at = planned->exposures[0].at;
  EXPECT_EQ(at.plane, 0);
  EXPECT_EQ(at.exposure, 40ms + 2 * rule.dark());
  EXPECT_EQ(planned->pictures[0], PlanePlan(24, 0));
  EXPECT_EQ(planned->order[0], planned->order[1]) << "the picture stays";
  expect_schedule(std::vector<WantedExposure>{{0, 0, 40ms}, {1, 0, 1ms}}, rule);
}

TEST(PlaneSchedule, planes_with_dark_time_between_them_hold_no_long_exposure) {
  PlaneRules rule = rules();
  EXPECT_EQ(*longest_in_planes(rule), 24 * 684us - 15us);
  rule.timing.exposure = 400us;
  EXPECT_EQ(*longest_in_planes(rule), 385us);
  EXPECT_EQ(plan_planes(one_each(1, 386us), rule).error().code, ErrorCode::limit);
  rule.settle = 400us;
  EXPECT_EQ(longest_in_planes(rule).error().code, ErrorCode::limit);
  rule = rules();
  rule.reaction = 150us;
  EXPECT_EQ(*longest_in_planes(rule), 24 * 684us - 165us);
  rule.reaction = 680us;
  EXPECT_EQ(longest_in_planes(rule).error().code, ErrorCode::limit) << "it would begin in the next plane";
}

TEST(PlaneSchedule, an_exposure_that_must_not_cross_is_no_longer_than_a_picture) {
  PlaneRules rule = rules();
  rule.crosses = false;
  ASSERT_OK(plan_planes(one_each(3, *longest_in_planes(rule)), rule));
  EXPECT_EQ(plan_planes(one_each(1, *longest_in_planes(rule) + 1ns), rule).error().code, ErrorCode::limit);
}

// Each shot has a picture of its own, which is on the screen in its refreshes only.
TEST(PlaneShots, are_alone_in_their_refreshes_and_keep_the_cameras_gap) {
  for (const int hold : {1, 2}) {
    PlaneRules rule = rules();
    rule.hold = hold;
    rule.gap = 40ms;  // longer than two refreshes
    std::vector<PlaneShot> shots;
    std::vector<WantedExposure> wanted;
    for (int k = 0; k < 24; ++k) {
      shots.push_back({23 - k, std::uint32_t{1} << static_cast<unsigned>(k)});
      wanted.push_back({static_cast<std::size_t>(k), 0, longest_in_one_plane(rule)});
    }
    const PlaneSchedule planned = plan_shots(shots, wanted, 7, rule);
    ASSERT_EQ(planned.exposures.size(), 24U);
    Nanoseconds ready{0};
    std::size_t dark = planned.order.size();
    for (std::size_t i = 0; i < 24; ++i) {
      const auto& [what, at] = planned.exposures[i];
      EXPECT_EQ(what.photograph, i);
      EXPECT_EQ(at.plane, shots[i].plane);
      EXPECT_EQ(at.planes, 1);
      EXPECT_GE(begin(at, rule), ready);
      ready = begin(at, rule) + rule.settle + at.exposure + rule.gap + plane_lead(rule.timing.period);
      EXPECT_LE(rule.settle + at.exposure, rule.timing.period);
      const auto refresh = static_cast<std::size_t>(at.refresh);
      EXPECT_EQ(refresh % static_cast<std::size_t>(hold), 0U);
      const std::size_t picture = planned.order[refresh];
      EXPECT_EQ(std::ranges::count(planned.order, picture), hold) << "in its refreshes only";
      dark -= static_cast<std::size_t>(hold);
      for (int k = 0; k < 24; ++k) {
        const int lit = (shots[i].lit >> static_cast<unsigned>(k) & 1U) != 0 ? 7 : kBlackPlane;
        EXPECT_EQ(planned.pattern(picture, k), k == at.plane ? static_cast<int>(i) : lit);
      }
    }
    EXPECT_EQ(std::ranges::count(planned.order, 0U), static_cast<std::ptrdiff_t>(dark)) << "else black";
  }
}

// Two shots of one picture are as far apart as the camera needs, and no farther.
TEST(PlaneShots, share_a_picture_when_it_lights_the_planes_of_both) {
  PlaneRules rule = rules();
  rule.gap = 2ms;
  const Nanoseconds exposure = longest_in_one_plane(rule);
  constexpr int apart = 5;  // 0.67 and 2 ms, and a quarter of a plane before an edge, in planes of 0.684 ms
  constexpr std::uint32_t kLit = 0b100001000010000100001;  // every fifth
  const std::vector<PlaneShot> shots{{0, kLit},  {5, kLit},  {10, kLit}, {14, kLit},
                                     {15, kLit}, {20, kLit}, {1, 2}};
  std::vector<WantedExposure> wanted;
  for (std::size_t k = 0; k < shots.size(); ++k) wanted.push_back({k, 0, exposure});
  const PlaneSchedule planned = plan_shots(shots, wanted, 9, rule);
  const std::vector<std::int64_t> refreshes{0, 0, 0, 1, 2, 2, 3};
  ASSERT_EQ(planned.exposures.size(), shots.size());
  for (std::size_t k = 0; k < shots.size(); ++k) {
    EXPECT_EQ(planned.exposures[k].at.plane, shots[k].plane);
    EXPECT_EQ(planned.exposures[k].at.refresh, refreshes[k]) << k;
    if (k == 0) continue;
    EXPECT_GE(begin(planned.exposures[k].at, rule),
              begin(planned.exposures[k - 1].at, rule) + apart * rule.timing.period);
  }
  const std::size_t first = planned.order[0];
  for (int k = 0; k < 24; ++k) {
    const bool own = k == 0 || k == 5 || k == 10;
    EXPECT_EQ(planned.pattern(first, k), own ? k / 5 : k == 15 || k == 20 ? 9 : kBlackPlane) << k;
  }
}

}  // namespace

}  // namespace symrig::plane_schedule_test

namespace symrig::plane_check_test {

namespace {

using board_sim::SimPlaneProjector;

/// A virtual rig in which the projector has faults.
Result<std::unique_ptr<VirtualRig>> open_with(const std::function<void(SimPlaneProjector::Faults&)>& faults,
                                              const std::string& noise = "camera",
                                              const std::function<void(RigOptions&)>& options = {},
                                              const std::string& profile = "dlpc350") {
  VirtualRigHooks hooks;
  hooks.planes = [&](SimPlaneProjector& raster, board_sim::SimBoard& /*board*/) { faults(raster.faults); };
  hooks.options = [&](RigOptions& set) {
    if (options) options(set);
  };
  return open_virtual_rig(fmt::format("sim:vgroove-textured?size=24x32&profile={}&noise={}", profile, noise),
                          hooks);
}

/// In the place of plane k comes plane order[k].
Result<std::unique_ptr<VirtualRig>> open_in_order(const std::vector<int>& order,
                                                  const std::string& noise = "camera",
                                                  const std::string& profile = "dlpc350") {
  return open_with([&order](SimPlaneProjector::Faults& faults) { faults.order = order; }, noise, {}, profile);
}

std::vector<int> in_place() {
  std::vector<int> order(24);
  std::iota(order.begin(), order.end(), 0);
  return order;
}

std::string refusal_of(const Result<std::unique_ptr<VirtualRig>>& opened) {
  EXPECT_FALSE(opened.ok());
  if (opened.ok()) return {};
  EXPECT_EQ(opened.error().code, ErrorCode::device_refused);
  return opened.error().line();
}

void expect_parts(const std::string& line, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) EXPECT_NE(line.find(part), std::string::npos) << part << ": " << line;
}

TEST(PlaneCheck, planes_in_their_places_are_taken_without_a_warning) {
  for (const char* noise : {"camera", "off"}) {
    const auto opened = open_in_order(in_place(), noise);
    ASSERT_OK(opened);
    EXPECT_TRUE((*opened)->rig().trouble().warnings.empty());
    EXPECT_EQ((*opened)->rig().trouble().retaken, 0);
  }
}

// Two neighbours are the least that an order can differ in.
TEST(PlaneCheck, any_two_neighbours_that_change_places_are_refused) {
  for (std::size_t k = 0; k + 1 < 24; ++k) {
    std::vector<int> order = in_place();
    std::swap(order[k], order[k + 1]);
    const std::string line = refusal_of(open_in_order(order, "off"));
    expect_parts(line, {"in the place of plane " + std::to_string(k) + " came plane " + std::to_string(k + 1),
                        "of plane " + std::to_string(k + 1) + " plane " + std::to_string(k)});
  }
}

// A camera that is ready after a few planes looks at several planes of a picture.
TEST(PlaneCheck, any_two_planes_that_change_places_are_refused_with_a_fast_camera) {
  ASSERT_OK(open_in_order(in_place(), "camera", "dlpc350-fast"));
  for (std::size_t k = 0; k < 24; ++k)
    for (std::size_t m = k + 1; m < 24; ++m) {
      std::vector<int> order = in_place();
      std::swap(order[k], order[m]);
      const std::string line = refusal_of(open_in_order(order, "off", "dlpc350-fast"));
      expect_parts(line,
                   {fmt::format("in the place of plane {} came plane {}, of plane {} plane {}", k, m, m, k)});
    }
  // Steps between the planes that a picture lights, too.
  for (int shift = 1; shift < 24; ++shift) {
    std::vector<int> order = in_place();
    for (int& plane : order) plane = (plane + shift) % 24;
    refusal_of(open_in_order(order, "off", "dlpc350-fast"));
  }
}

// The check takes 13 refreshes instead of 26. Metering and dark photographs are no slower.
TEST(PlaneCheck, takes_less_time_with_a_faster_camera) {
  const auto opening = [](const char* profile) {
    const auto opened = open_with([](SimPlaneProjector::Faults&) {}, "camera", {}, profile);
    return opened ? (*opened)->rig().cost().rig_seconds : 0;
  };
  EXPECT_LT(opening("dlpc350-fast"), opening("dlpc350") - 12.0 / 60);
}

TEST(PlaneCheck, another_order_of_colours_is_refused_with_the_key_that_names_it) {
  std::vector<int> order = in_place();
  for (std::size_t k = 0; k < 8; ++k) std::swap(order[k], order[k + 8]);
  for (const char* noise : {"camera", "off"})
    expect_parts(refusal_of(open_in_order(order, noise)),
                 {"in the place of plane 0 came plane 8, of plane 1 plane 9", "and so on",
                  "set projector.plane_order = \"RGB\""});
  for (std::size_t k = 0; k < 24; ++k) order[k] = static_cast<int>(8 * (k / 8) + 7 - k % 8);
  expect_parts(refusal_of(open_in_order(order)), {"set projector.plane_order = \"GRB highest first\""});
}

TEST(PlaneCheck, a_missing_or_doubled_plane_is_refused) {
  std::vector<int> order = in_place();
  for (const std::size_t missing : {0U, 12U, 17U, 23U}) {  // 0 and 12 have the reference shots, too
    order = in_place();
    order[missing] = -1;
    expect_parts(refusal_of(open_in_order(order)),
                 {fmt::format("in the place of plane {} came no plane", missing), "pattern table"});
  }
  order = in_place();
  order[17] = 16;
  expect_parts(refusal_of(open_in_order(order)), {"in the place of plane 17 came plane 16"});
}

TEST(PlaneCheck, edges_that_are_a_plane_off_are_refused) {
  for (const int shift : {-2, -1, 1, 2}) {
    std::vector<int> order = in_place();
    for (int& plane : order) plane = plane + shift < 0 || plane + shift > 23 ? -1 : plane + shift;
    expect_parts(refusal_of(open_in_order(order)),
                 {std::to_string(std::abs(shift)) + (std::abs(shift) == 1 ? " plane " : " planes ") +
                      (shift > 0 ? "late" : "early"),
                  "projector.plane_delay_us"});
  }
}

TEST(PlaneCheck, a_sequence_that_does_not_begin_again_at_vsync_is_refused) {
  expect_parts(refusal_of(open_with([](SimPlaneProjector::Faults& faults) { faults.runs_free = true; })),
               {"each refresh must begin with plane 0"});
}

// A camera whose shortest exposure is longer than a plane of 684 us cannot see a single plane.
TEST(PlaneCheck, a_camera_with_longer_exposures_than_a_plane_is_told_what_was_not_checked) {
  const auto longer = [](RigOptions& options) { options.setup.camera.min_exposure = Nanoseconds{1'000'000}; };
  const auto opened = open_with([](SimPlaneProjector::Faults&) {}, "camera", longer);
  ASSERT_OK(opened);
  const auto& warnings = (*opened)->rig().trouble().warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("the order of the bit planes was not checked"), std::string::npos);
}

}  // namespace

}  // namespace symrig::plane_check_test
