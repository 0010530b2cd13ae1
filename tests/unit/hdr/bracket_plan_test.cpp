// SPDX-License-Identifier: Apache-2.0
// What a planned bracket must reach, what it may cost, and which rules it keeps.
#include "symrig/hdr/bracket_plan.hpp"

#include "simulated_sensor.hpp"
#include "symrig/hdr/merge.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bracket_plan_test {
namespace {

using namespace std::chrono_literals;

const NoiseModel kSensor = NoiseModel::from_electrons({});
constexpr LightPath kPath{1e-7, 0};  // white fills the well in 2 ms

Expectation one_part(std::vector<ExpectedLight> lights, double sigma) {
  Expectation expected;
  expected.parts.push_back({std::move(lights), sigma * sigma});
  return expected;
}

/// Mean square noise of a part after a bracket, by the formula of the merge, in radiance².
double noise_of(const ExpectedPart& part, const std::vector<Nanoseconds>& exposures, double headroom = 1.25) {
  double sum = 0, pixels = 0;
  for (const ExpectedLight& light : part.lights) {
    double information = 0;
    for (const Nanoseconds t : exposures)
      information += exposure_information(kSensor, light.radiance / kPath.scale, seconds(t), headroom);
    sum += light.pixels *
           (information > 0 ? kPath.scale * kPath.scale / information : 4 * light.radiance * light.radiance);
    pixels += light.pixels;
  }
  return sum / pixels;
}

double cost_of(const std::vector<Nanoseconds>& exposures, const ExposureRules& rules) {
  double sum = 0;
  for (const Nanoseconds t : exposures) sum += seconds(t + rules.each_frame);
  return sum;
}

TEST(BracketPlan, OneLevelTakesOneFrameJustLongEnough) {
  const Expectation expected = one_part({{0.01, 1000}}, 1e-4);
  const auto plan = plan_bracket(expected, kPath, kSensor, {});
  ASSERT_TRUE(plan.ok()) << plan.error().line();
  ASSERT_EQ(plan->exposures.size(), 1U);
  EXPECT_LE(plan->noise, 1);
  EXPECT_LE(noise_of(expected.parts[0], plan->exposures), 1e-8);
}

TEST(BracketPlan, BrightAndDarkPartsTakeOneFrameEach) {
  Expectation expected = one_part({{0.8, 1000}}, 0.01);
  expected.parts.push_back({{{0, 5000}, {1e-3, 500}}, 1e-10});
  const auto plan = plan_bracket(expected, kPath, kSensor, {});
  ASSERT_TRUE(plan.ok()) << plan.error().line();
  EXPECT_EQ(plan->exposures.size(), 2U);
  for (const ExpectedPart& part : expected.parts)
    EXPECT_LE(noise_of(part, plan->exposures), part.noise * (1 + 1e-9));
}

// Against every bracket of up to three exposures √2 apart, by the same prices: no cheaper one is good enough.
TEST(BracketPlan, NoBracketOfTheLadderIsCheaper) {
  Expectation expected = one_part({{0.5, 100}, {0.05, 100}}, 0.004);
  expected.parts.push_back({{{0, 1000}, {1e-3, 100}, {2e-2, 10}}, 1e-9});
  const ExposureRules rules{.each_frame = 50ms};
  const auto plan = plan_bracket(expected, kPath, kSensor, rules);
  ASSERT_TRUE(plan.ok()) << plan.error().line();
  std::vector<Nanoseconds> ladder;
  // 20 us to 10 s.
  for (int step = 0; 20e-6 * std::pow(2, step / 2.0) < 10; ++step)
    ladder.emplace_back(std::llround(20e3 * std::pow(2, step / 2.0)));
  const auto good = [&](const std::vector<Nanoseconds>& bracket) {
    return std::all_of(expected.parts.begin(), expected.parts.end(), [&](const ExpectedPart& part) {
      return noise_of(part, bracket) <= part.noise * (1 - 1e-6);
    });
  };
  double cheapest = 1e9;
  for (std::size_t a = 0; a < ladder.size(); ++a) {
    if (good({ladder[a]})) cheapest = std::min(cheapest, cost_of({ladder[a]}, rules));
    for (std::size_t b = a; b < ladder.size(); ++b) {
      if (good({ladder[a], ladder[b]})) cheapest = std::min(cheapest, cost_of({ladder[a], ladder[b]}, rules));
      for (std::size_t c = b; c < ladder.size(); ++c)
        if (good({ladder[a], ladder[b], ladder[c]}))
          cheapest = std::min(cheapest, cost_of({ladder[a], ladder[b], ladder[c]}, rules));
    }
  }
  EXPECT_LE(cost_of(plan->exposures, rules), 1.1 * cheapest * (1 + 1e-6));  // wells are filled for a tenth
  EXPECT_LE(plan->noise, 1);
}

TEST(BracketPlan, ExposuresAreWholePeriodsWithinTheCamerasRange) {
  ExposureRules rules;
  rules.whole_periods = 16'666'667ns;
  rules.min_exposure = 20ms;
  rules.max_exposure = 500ms;
  Expectation expected = one_part({{0.01, 1000}}, 1e-4);
  expected.parts.push_back({{{0, 1000}}, 1e-12});
  const auto plan = plan_bracket(expected, kPath, kSensor, rules);
  ASSERT_TRUE(plan.ok()) << plan.error().line();
  for (const Nanoseconds t : plan->exposures) {
    EXPECT_EQ(t % rules.whole_periods, 0ns);
    EXPECT_GE(t, rules.min_exposure);
    EXPECT_LE(t, rules.max_exposure);
  }
}

TEST(BracketPlan, RepeatsWhatOneWellCannotHoldAndSaysWhatTimeDidNotAllow) {
  // 0.1 fills the well in 20 ms: σ = 1e-4 takes 1 / (0.1 / 1e-7 / 1e6 ...) = photons alone 1e6, 60 wells.
  Expectation expected = one_part({{0.1, 1000}}, 1e-4);
  const auto plan = plan_bracket(expected, kPath, kSensor, {});
  ASSERT_TRUE(plan.ok());
  EXPECT_GT(plan->exposures.size(), 50U);
  expected.longest_seconds = 0.1;
  const auto hasty = plan_bracket(expected, kPath, kSensor, {});
  ASSERT_TRUE(hasty.ok());
  double sum = 0;
  for (const Nanoseconds t : hasty->exposures) sum += seconds(t);
  EXPECT_LE(sum, 0.1);
  EXPECT_NEAR(hasty->noise, noise_of(expected.parts[0], hasty->exposures) / 1e-8, 1e-6 * hasty->noise);
  EXPECT_GT(hasty->noise, 1);
}

/// kSensor reads out as long as ExposureRules::each_frame says.
double seconds_of(const BracketPlan& plan, const ExposureRules& rules) {
  double sum = 0;
  for (const Nanoseconds t : plan.exposures) sum += seconds(t + rules.each_frame);
  return sum;
}

TEST(BracketPlan, EndsInTheSecondsThatABudgetLeaves) {
  ExposureRules rules;
  rules.each_frame = 20ms;
  Expectation expected = one_part({{0.1, 1000}, {1e-4, 1000}}, 1e-4);
  const auto free = plan_bracket(expected, kPath, kSensor, rules);
  ASSERT_TRUE(free.ok());
  EXPECT_FALSE(free->held_short);
  for (const double most : {0.5, 0.1, 0.03}) {
    expected.most_seconds = most;
    const auto plan = plan_bracket(expected, kPath, kSensor, rules);
    ASSERT_TRUE(plan.ok());
    EXPECT_LE(seconds_of(*plan, rules), most);
    EXPECT_TRUE(plan->held_short) << most;
    EXPECT_GT(plan->noise, 1);
  }
  // Enough seconds change nothing; with none there is one frame.
  expected.most_seconds = 2 * seconds_of(*free, rules);
  const auto enough = plan_bracket(expected, kPath, kSensor, rules);
  EXPECT_EQ(enough->exposures, free->exposures);
  EXPECT_FALSE(enough->held_short);
  expected.most_seconds = 0;
  const auto none = plan_bracket(expected, kPath, kSensor, rules);
  EXPECT_EQ(none->exposures, std::vector{rules.min_exposure});
}

TEST(BracketPlan, NotesABudgetThatEndedTheExposures) {
  Expectation expected;
  expected.coarser_steps = 3;
  EXPECT_EQ(expected.budget_note(false), 3);
  std::set<std::int32_t> notes;
  for (const double most : {1e-9, 0.01, 1.0, 1.2, 60.0, 3000.0, 1e9})
    for (const int steps : {0, 1, 19}) {
      expected.most_seconds = whole_most_seconds(most);
      expected.coarser_steps = steps;
      EXPECT_LE(expected.most_seconds, std::max(most, whole_most_seconds(0)));
      EXPECT_GE(expected.budget_note(true), Expectation::kHeldShort);
      EXPECT_LE(expected.budget_note(true), Expectation::kLastNote);
      notes.insert(expected.budget_note(true));
      EXPECT_EQ(whole_most_seconds(expected.most_seconds), expected.most_seconds);
    }
  EXPECT_EQ(notes.size(), 21U);
}

TEST(BracketPlan, BlackLightFillsTheWellToo) {
  // 0.05 of black is 5e5 e-/s: longer than 40 ms the pixel is full, and what is full is not seen.
  const auto dark = plan_bracket(one_part({{1e-3, 1000}}, 1e-5), kPath, kSensor, {});
  const auto grey = plan_bracket(one_part({{1e-3, 1000}}, 1e-5), {1e-7, 0.05}, kSensor, {});
  ASSERT_TRUE(dark.ok() && grey.ok());
  EXPECT_GT(dark->exposures.back(), 40ms);
  for (const Nanoseconds t : grey->exposures) EXPECT_LT(t, 40ms);
}

TEST(BracketPlan, RefusesWhatCannotBePlanned) {
  const auto code = [](const Expectation& expected, const LightPath& path = kPath) {
    return plan_bracket(expected, path, kSensor, {}).error().code;
  };
  EXPECT_EQ(code({}), ErrorCode::bad_argument);
  EXPECT_EQ(code(one_part({}, 1)), ErrorCode::bad_argument);
  EXPECT_EQ(code(one_part({{1, 1}}, 0)), ErrorCode::bad_argument);
  EXPECT_EQ(code(one_part({{NAN, 1}}, 1)), ErrorCode::bad_argument);
  EXPECT_EQ(code(one_part({{1, 1}}, 1), {0, 0}), ErrorCode::bad_argument);
  Expectation hasty = one_part({{1, 1}}, 1);
  hasty.longest_seconds = 1e-6;
  EXPECT_EQ(code(hasty), ErrorCode::bad_argument);
}

TEST(LightHistogram, KeepsPixelsAndEnergyToAQuarterOctave) {
  LightHistogram histogram;
  for (int k = 0; k < 1000; ++k) histogram.add(0.3F);
  histogram.add(-1.0F);
  histogram.add(0.0F);
  EXPECT_EQ(histogram.pixels(), 1002);
  EXPECT_NEAR(std::sqrt(histogram.mean_square() * 1.002), 0.3, 0.3 * 0.13);
  const auto lights = histogram.lights();
  ASSERT_EQ(lights.size(), 2U);
  EXPECT_EQ(lights[0].radiance, 0);
  EXPECT_EQ(lights[0].pixels, 2);
  EXPECT_GE(lights[1].radiance, 0.3);  // the upper end: no pixel is planned darker than it is
  EXPECT_LE(lights[1].radiance, 0.3 * 1.26);
}

}  // namespace

}  // namespace symrig::bracket_plan_test

namespace symrig::timing_test {

// Exposures against the projector's periods, and against each other.

namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kPeriod{16'666'667};

/// Light collected from `begin` on by a lamp that is on for `duty` of each period.
double collected(double begin, double exposure, double period, double duty) {
  const auto until = [&](double t) {
    const double whole = std::floor(t / period);
    return whole * duty * period + std::min(t - whole * period, duty * period);
  };
  return until(begin + exposure) - until(begin);
}

// The formula against the light collected at 10,000 phases; between two of them it changes by 1e-4 of a
// period.
TEST(Beat, ForecastIsTheSpreadOverAllPhases) {
  for (const double duty : {0.2, 0.5, 0.9})
    for (const double periods : {0.1, 0.7, 1.3, 2.5, 7.9}) {
      const double period = seconds(kPeriod), t = periods * period;
      double low = 1e9, high = 0;
      for (int k = 0; k < 10'000; ++k) {
        const double light = collected(k * period / 10'000, t, period, duty);
        low = std::min(low, light);
        high = std::max(high, light);
      }
      const auto beat = forecast_beat(Nanoseconds(std::llround(1e9 * t)), kPeriod, duty);
      ASSERT_TRUE(beat.ok());
      EXPECT_NEAR(beat->spread, (high - low) / (t * duty), 3e-4 / (periods * duty)) << duty << ' ' << periods;
    }
}

TEST(Beat, WholePeriodsDoNotBeat) {
  const auto whole = forecast_beat(3 * kPeriod, kPeriod);
  ASSERT_TRUE(whole.ok());
  EXPECT_FALSE(whole->beats());
  const auto sixtieth = forecast_beat(16'666'000ns, kPeriod);  // as people write it
  EXPECT_FALSE(sixtieth->beats());
  const auto short_one = forecast_beat(10ms, kPeriod);
  EXPECT_TRUE(short_one->beats());
  EXPECT_EQ(short_one->nearest_whole, kPeriod);
  EXPECT_EQ(short_one->to_string(10ms, kPeriod),
            "exposure 10 ms is 0.6 periods of 16.67 ms: its light may vary by 1.3e+02 %; 16.67 ms is whole");
  EXPECT_EQ(forecast_beat(0ns, kPeriod).error().code, ErrorCode::bad_argument);
}

/// Frames of a scene over three decades whose shutter does not keep what it is told.
struct Shutters {
  NoiseModel sensor = NoiseModel::from_electrons({});
  std::vector<std::vector<std::uint16_t>> codes;
  std::vector<Frame> frames;

  Shutters(const std::vector<Nanoseconds>& told, const std::vector<double>& kept) {
    test::Random random(12);
    for (std::size_t k = 0; k < told.size(); ++k) {
      test::Random scene(13);
      codes.emplace_back();
      for (int i = 0; i < 50'000; ++i)
        codes.back().push_back(test::sample(
            sensor, std::pow(10, 3 * scene.uniform()) * 2e3 * seconds(told[k]) * kept[k], random));
    }
    for (std::size_t k = 0; k < told.size(); ++k) frames.push_back({codes[k], told[k]});
  }
};

TEST(ExposureRatio, AgreesWithHonestShuttersWithinItsError) {
  const Shutters world({5ms, 40ms, 320ms}, {1, 1, 1});
  const auto ratios = exposure_ratios(world.frames, world.sensor);
  ASSERT_TRUE(ratios.ok()) << ratios.error().line();
  ASSERT_EQ(ratios->size(), 2U);
  for (const ExposureRatio& ratio : *ratios) {
    EXPECT_FALSE(ratio.wrong()) << ratio.to_string();
    EXPECT_NEAR(ratio.seen / 8, 1, 5 * ratio.sigma) << ratio.to_string();
    EXPECT_LT(ratio.sigma, 0.002);
  }
}

TEST(ExposureRatio, NamesTheLabelThatIsOff) {
  const Shutters world({320ms, 5ms, 40ms}, {1, 1, 1 / 1.05});  // in any order
  const auto ratios = exposure_ratios(world.frames, world.sensor);
  ASSERT_TRUE(ratios.ok());
  ASSERT_EQ(ratios->size(), 2U);
  EXPECT_EQ((*ratios)[0].shorter, 1U);
  EXPECT_EQ((*ratios)[0].longer, 2U);
  EXPECT_TRUE((*ratios)[0].wrong()) << (*ratios)[0].to_string();
  EXPECT_NEAR((*ratios)[0].seen, 8 / 1.05, 5 * (*ratios)[0].sigma * 8);
  EXPECT_TRUE((*ratios)[1].wrong());
  EXPECT_NEAR((*ratios)[1].seen, 8 * 1.05, 5 * (*ratios)[1].sigma * 8);
}

TEST(ExposureRatio, WithoutOverlapThereIsNoAnswer) {
  const NoiseModel sensor = NoiseModel::from_electrons({});
  const std::vector<std::uint16_t> black(1000, 64), white(1000, 4095);
  const std::vector<Frame> frames{{black, 1ms}, {white, 100ms}};
  const auto ratios = exposure_ratios(frames, sensor);
  ASSERT_TRUE(ratios.ok());
  EXPECT_TRUE(ratios->empty());
}

}  // namespace

}  // namespace symrig::timing_test
