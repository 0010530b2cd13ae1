// SPDX-License-Identifier: Apache-2.0
// Exposures against the projector's periods, and against each other.
#include "simulated_sensor.hpp"
#include "symrig/hdr/bracket_plan.hpp"
#include "symrig/hdr/merge.hpp"

#include <gtest/gtest.h>

namespace symrig::timing_test {
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
