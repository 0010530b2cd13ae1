// SPDX-License-Identifier: Apache-2.0
// Which exposure is taken in which plane of which picture.
#include "rig/plane_schedule.hpp"

#include "assert_ok.hpp"
#include "symrig/base/random.hpp"
#include "symrig/program/bracket.hpp"

#include <set>
#include <utility>

#include <gtest/gtest.h>

namespace symrig::plane_schedule_test {
namespace {

using namespace std::chrono_literals;

PlaneRules rules() {
  return {{24, 684us, 684us, 20us, 1}, 16'666'667ns, 10us, 5ms};
}

Nanoseconds begin(const PlaneExposure& at, const PlaneRules& rule) {
  return at.refresh * rule.refresh + rule.timing.frame_lead + at.plane * rule.timing.period;
}

/// What every schedule keeps: each exposure once, in planes with its own pattern, inside of them, one after
/// the other with the camera's gap, and in time for the wait for its edge.
void expect_schedule(std::span<const WantedExposure> wanted, const PlaneRules& rule) {
  const auto planned = plan_planes(wanted, rule);
  ASSERT_OK(planned);
  std::set<std::pair<std::size_t, std::size_t>> taken;
  for (const PlanePicture& picture : *planned) {
    EXPECT_LE(picture.plan.size(), static_cast<std::size_t>(rule.timing.planes));
    Nanoseconds ready{0};
    for (const auto& [what, at] : picture.exposures) {
      EXPECT_TRUE(taken.emplace(what.photograph, what.exposure).second);
      EXPECT_EQ(at.exposure, what.time);
      for (int k = at.plane; k < at.plane + at.planes; ++k)
        EXPECT_EQ(picture.plan.at(static_cast<std::size_t>(k)), static_cast<int>(what.photograph));
      EXPECT_LT(rule.settle + what.time, at.planes * rule.timing.period);
      EXPECT_GE(begin(at, rule), ready);
      ready = begin(at, rule) + rule.settle + what.time + rule.gap + plane_lead(rule.timing.period);
    }
  }
  EXPECT_EQ(taken.size(), wanted.size());
}

TEST(PlaneSchedule, random_brackets_are_taken_once_each_in_their_planes) {
  Random random(3);
  for (int round = 0; round < 300; ++round) {
    PlaneRules rule = rules();
    rule.timing.planes = 1 + static_cast<int>(random.uniform() * 24);
    rule.gap = Nanoseconds{static_cast<std::int64_t>(random.uniform() * 30e6)};
    const auto longest = longest_in_planes(rule);
    ASSERT_OK(longest);
    std::vector<WantedExposure> wanted;
    const auto photographs = static_cast<std::size_t>(1 + random.uniform() * 40);
    for (std::size_t i = 0; i < photographs; ++i)
      for (std::size_t j = 0; j < 1 + i % 4; ++j) {
        const double share = random.uniform() * random.uniform();
        wanted.push_back({i, j,
                          Nanoseconds{20'000 + static_cast<std::int64_t>(
                                                   share * static_cast<double>(longest->count() - 20'000))}});
      }
    expect_schedule(wanted, rule);
  }
}

TEST(PlaneSchedule, short_exposures_share_a_picture_and_take_what_the_camera_takes) {
  std::vector<WantedExposure> wanted;
  for (std::size_t i = 0; i < 24; ++i) wanted.push_back({i, 0, 300us});
  const auto planned = plan_planes(wanted, rules());
  ASSERT_OK(planned);
  ASSERT_EQ(planned->size(), 1U) << "24 patterns in one picture";
  // A frame takes 0.3 + 5 ms, rounded up to planes: 9 planes. A refresh has room for 3 frames at most.
  EXPECT_LE((*planned)[0].exposures.back().at.refresh, 24 / 2);
  expect_schedule(wanted, rules());
}

TEST(PlaneSchedule, a_bracket_repeats_the_planes_of_its_pattern) {
  const std::vector<WantedExposure> wanted{{0, 0, 100us}, {0, 1, 1600us}, {1, 0, 50us}};
  const auto planned = plan_planes(wanted, rules());
  ASSERT_OK(planned);
  ASSERT_EQ(planned->size(), 1U);
  EXPECT_EQ((*planned)[0].plan, (PlanePlan{0, 0, 0, 1}));
}

TEST(PlaneSchedule, longer_exposures_are_whole_refreshes_of_one_pattern) {
  const PlaneRules rule = rules();
  const Nanoseconds refresh_light = 24 * 684us;
  EXPECT_EQ(*light_in_planes(3ms, rule), 3ms);
  EXPECT_EQ(*light_in_planes(24 * 684us, rule), refresh_light);
  EXPECT_EQ(*light_in_planes(40ms, rule), 2 * refresh_light) << "never longer than wanted";
  const std::vector<WantedExposure> wanted{{0, 0, 1ms}, {0, 1, 40ms}, {1, 0, 1ms}};
  const auto planned = plan_planes(wanted, rule);
  ASSERT_OK(planned);
  ASSERT_EQ(planned->size(), 2U) << "the pattern fills a picture";
  EXPECT_EQ((*planned)[0].plan, PlanePlan(24, 0));
  const PlaneExposure& shutter = (*planned)[0].exposures[1].at;
  EXPECT_EQ(shutter.exposure, 2 * rule.refresh);
  EXPECT_TRUE(over_refreshes(shutter, rule));
  EXPECT_NEAR(static_cast<double>(light_of(shutter, shutter.exposure, rule).count()),
              static_cast<double>((2 * refresh_light).count()), 1);
  EXPECT_EQ(light_of((*planned)[0].exposures[0].at, 1ms, rule), 1ms);
}

TEST(PlaneSchedule, planes_with_dark_time_between_them_hold_no_long_exposure) {
  PlaneRules rule = rules();
  EXPECT_EQ(*longest_in_planes(rule), 24 * 684us - 15us);
  rule.timing.exposure = 400us;
  EXPECT_EQ(*longest_in_planes(rule), 385us);
  const std::vector<WantedExposure> wanted{{0, 0, 386us}};
  EXPECT_EQ(plan_planes(wanted, rule).error().code, ErrorCode::limit);
  rule.settle = 400us;
  EXPECT_EQ(longest_in_planes(rule).error().code, ErrorCode::limit);
}

}  // namespace
}  // namespace symrig::plane_schedule_test
