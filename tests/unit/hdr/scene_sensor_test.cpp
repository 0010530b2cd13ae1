// SPDX-License-Identifier: Apache-2.0
// A sensor measured from pairs of frames of a scene with texture, edges and highlights.
#include "simulated_sensor.hpp"
#include "symrig/hdr/sensor.hpp"

#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::scene_sensor_test {
namespace {

using namespace std::chrono_literals;

constexpr Grid kGrid{96, 128};
constexpr Nanoseconds kFull = 10ms;  // the brightest part of the scene just saturates

/// A scene whose light spans a factor of 300, in steps from pixel to pixel, behind a sensor of any kind.
struct World {
  NoiseModel noise = NoiseModel::from_electrons({});
  double dark_rate = 0;                         // [e-/s]
  double lamp = 1;                              // at present
  double flicker = 0;                           // rms, from frame to frame
  std::function<double(double)> response = {};  // of a share of full scale
  std::vector<std::size_t> hot = {};            // pixels
  double leak = 0;                              // share of the scene's light with a black projector
  test::Random random{1};

  static double light(std::size_t i) {
    const std::size_t row = i / 128, col = i % 128;
    const double texture = 0.02 + 0.3 * static_cast<double>((i * 2'654'435'761U >> 7U) % 1000) / 1000;
    const double patch = row / 24 == 1 && col > 40 ? 1.0 : 0.4;
    return col < 16 ? 0.003 : col > 120 && row < 4 ? 3.0 : texture * patch + (row > 36 ? 0.6 * patch : 0);
  }
  std::vector<std::uint16_t> frame(bool lit, Nanoseconds exposure) {
    const double now = lamp * (1 + flicker * random.normal()), t = seconds(exposure);
    std::vector<std::uint16_t> codes;
    for (std::size_t i = 0; i < static_cast<std::size_t>(kGrid.size()); ++i) {
      const double share = light(i) * (lit ? now : leak) * t / seconds(kFull);
      double code = test::sample(noise, share * noise.full_well() + dark_rate * t, random);
      if (response) code = std::round(noise.max_code() * response(code / noise.max_code()));
      codes.push_back(static_cast<std::uint16_t>(code));
    }
    for (const std::size_t i : hot)
      codes[i] = static_cast<std::uint16_t>(std::min(codes[i] + 500, noise.max_code()));
    return codes;
  }
};

struct Ladder {
  int dark = 8;  // frames at the shortest exposure
  int pairs = 2;
  std::vector<double> shares{0.1, 0.2, 0.35, 0.5, 0.65, 2.5};
};

/// fails: as SceneTransfer. between: called before each lit level.
Result<SceneSensor> measure(World& world, const Ladder& ladder = {},
                            const std::function<void(std::size_t)>& between = {}) {
  SceneTransfer transfer(kGrid, world.noise.bits());
  const auto level = [&](bool lit, Nanoseconds exposure, int pairs) -> Result<void> {
    SYMRIG_CHECK(transfer.begin({lit, exposure}));
    for (int k = 0; k < pairs; ++k) {
      const auto first = world.frame(lit, exposure), second = world.frame(lit, exposure);
      SYMRIG_CHECK(transfer.add(first, second));
    }
    return {};
  };
  const auto at = [](double share) { return Nanoseconds(std::llround(share * 1e9 * seconds(kFull))); };
  SYMRIG_CHECK(level(false, 20us, ladder.dark / 2));
  SYMRIG_CHECK(level(false, at(0.65), 1));
  SYMRIG_CHECK(level(false, at(2.5), 1));
  SYMRIG_CHECK(level(true, at(0.5), 2));
  for (std::size_t k = 0; k < ladder.shares.size(); ++k) {
    if (between) between(k);
    SYMRIG_CHECK(level(true, at(ladder.shares[k]), ladder.pairs));
  }
  SYMRIG_CHECK(level(true, at(0.5), 2));
  return transfer.finish();
}

class EverySensor : public testing::TestWithParam<NoiseModel::Electrons> {};

// z = error / stated sigma has unit variance if the statement is right. Over 12 seeds, Σ z² is χ² of 12:
// above 2.9 and below 33 but once in 1,000. The random numbers' Poisson variance is 1/18 of an electron too
// large, and their kurtosis that of a normal: far below a sigma.
TEST_P(EverySensor, states_how_far_it_is_off) {
  constexpr int kSeeds = 12;
  double gain = 0, read = 0, worst_gain = 0, worst_read = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    World world;
    world.noise = NoiseModel::from_electrons(GetParam());
    world.random = test::Random(static_cast<std::uint64_t>(seed) << 40U);  // streams that never meet
    const auto found = measure(world);
    ASSERT_TRUE(found.ok()) << found.error().line();
    ASSERT_TRUE(found->sensor);
    const Sensor& sensor = *found->sensor;
    const double of_gain = sensor.noise.gain() / world.noise.gain() - 1,
                 of_read = sensor.noise.read_noise() / world.noise.read_noise() - 1;
    gain += of_gain * of_gain / (sensor.gain_sigma * sensor.gain_sigma);
    read += of_read * of_read / (sensor.read_noise_sigma * sensor.read_noise_sigma);
    worst_gain = std::max(worst_gain, std::abs(of_gain));
    worst_read = std::max(worst_read, std::abs(of_read));
    // The mean of 8 · 12,288 samples.
    const double dark = world.noise.gain() * world.noise.read_noise();
    EXPECT_NEAR(sensor.noise.pedestal(), world.noise.pedestal(),
                5 * std::hypot(dark, 0.3) / std::sqrt(98'304.0));
    EXPECT_TRUE(found->clipping_seen);
    EXPECT_NEAR(sensor.noise.full_well() / world.noise.full_well(), 1,
                5 * sensor.gain_sigma + 1.0 / world.noise.max_code());
    EXPECT_TRUE(found->linearity.linear()) << found->linearity.worst;
    EXPECT_LT(found->linearity.worst, 0.01);
    EXPECT_EQ(sensor.prnu, 0);
    EXPECT_FALSE(found->response);
  }
  EXPECT_GT(gain, 2.9);
  EXPECT_LT(gain, 33);
  EXPECT_GT(read, 2.9);
  EXPECT_LT(read, 33);
  std::printf("gain off by %.2f %% at most, read noise by %.2f %%; chi2 of 12: %.1f, %.1f\n",
              100 * worst_gain, 100 * worst_read, gain, read);
}
INSTANTIATE_TEST_SUITE_P(
    Sensors, EverySensor,
    testing::Values(NoiseModel::Electrons{},
                    NoiseModel::Electrons{.full_well = 10'000, .read_noise = 3, .bits = 14},
                    NoiseModel::Electrons{.full_well = 40'000, .read_noise = 25, .bits = 12},
                    NoiseModel::Electrons{.full_well = 90'000, .read_noise = 12, .bits = 16, .pedestal = 600},
                    NoiseModel::Electrons{.full_well = 5'000, .read_noise = 15, .bits = 8, .pedestal = 12}));

// The linearity has one frame for each exposure, so a flicker of 0.3 % moves it by about that.
TEST(SceneSensor, a_lamp_that_flickers_moves_neither_gain_nor_read_noise) {
  World world;
  world.flicker = 0.003;
  const auto found = measure(world);
  ASSERT_TRUE(found.ok()) << found.error().line();
  ASSERT_TRUE(found->sensor);
  EXPECT_NEAR(found->sensor->noise.gain() / world.noise.gain(), 1, 5 * found->sensor->gain_sigma);
  EXPECT_NEAR(found->sensor->noise.read_noise() / world.noise.read_noise(), 1,
              5 * found->sensor->read_noise_sigma);
  // Of about 14 pairs: known to 1/√28.
  EXPECT_NEAR(found->flicker, 0.003, 5 * 0.003 / std::sqrt(28.0));
}

TEST(SceneSensor, a_lamp_that_drifts_is_refused) {
  World world;
  const auto found =
      measure(world, {}, [&](std::size_t k) { world.lamp = 1 + 0.01 * static_cast<double>(k); });
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::limit);
  EXPECT_NE(found.error().what.find("the light changed by 5"), std::string::npos) << found.error().line();
  World slow;
  const auto little =
      measure(slow, {}, [&](std::size_t k) { slow.lamp = 1 + 0.002 * static_cast<double>(k); });
  ASSERT_TRUE(little.ok()) << little.error().line();
  EXPECT_NEAR(little->drift, 0.01, 0.001);
}

// 800 e-/s in 25 ms are 20 e-, 4 DN. Four dark frames of 12,288 pixels know their mean to 0.006 DN.
TEST(SceneSensor, the_dark_signal_is_no_pedestal) {
  World world;
  world.dark_rate = 800;
  const auto found = measure(world);
  ASSERT_TRUE(found.ok()) << found.error().line();
  const double rate = world.noise.gain() * world.dark_rate;
  EXPECT_GT(found->dark_signal_sigma, 0);
  EXPECT_LT(found->dark_signal_sigma, 0.02 * rate);
  // 5 sigmas of the frames' mean, computed from the pixels' noise: 1.5 DN / √24,576 in 25 ms.
  EXPECT_NEAR(found->dark_signal, rate, 5 * 1.5 / std::sqrt(24'576.0) / 0.025);
  EXPECT_NEAR(found->sensor->noise.pedestal(), world.noise.pedestal(), 0.05);
}

// A black projector of a contrast of 1:50 shows the scene in the dark frames: 0.05 DN in 20 us at most, and
// none of its highlights is a hot pixel.
TEST(SceneSensor, a_black_projector_that_leaks_light_makes_no_defects) {
  World world;
  world.leak = 0.02;
  world.hot = {5, 777, 9000};
  const auto found = measure(world);
  ASSERT_TRUE(found.ok()) << found.error().line();
  std::vector<std::size_t> defects;
  for (std::size_t i = 0; i < found->sensor->defects.values().size(); ++i)
    if (found->sensor->defects.values()[i] != 0) defects.push_back(i);
  EXPECT_EQ(defects, world.hot);
  EXPECT_NEAR(found->sensor->noise.gain() / world.noise.gain(), 1, 5 * found->sensor->gain_sigma);
  EXPECT_NEAR(found->sensor->noise.read_noise() / world.noise.read_noise(), 1,
              5 * found->sensor->read_noise_sigma);
}

TEST(SceneSensor, a_white_level_below_the_largest_code_is_found) {
  World world;
  world.noise = NoiseModel::from_electrons({}).clipped_at(3600);
  const auto found = measure(world);
  ASSERT_TRUE(found.ok()) << found.error().line();
  EXPECT_TRUE(found->clipping_seen);
  EXPECT_NEAR(found->sensor->noise.clipping_code(), 3600, 2);  // the pile has the width of the read noise
}

TEST(SceneSensor, without_saturated_frames_the_largest_code_is_taken) {
  World world;
  Ladder ladder;
  ladder.shares = {0.05, 0.1, 0.2, 0.3};
  const auto found = measure(world, ladder);
  ASSERT_TRUE(found.ok()) << found.error().line();
  EXPECT_FALSE(found->clipping_seen);
  EXPECT_EQ(found->sensor->noise.clipping_code(), 4095);
}

TEST(SceneSensor, a_gamma_is_no_sensor_but_a_response) {
  World world;
  world.noise = NoiseModel::from_electrons({.full_well = 8'000, .bits = 8, .pedestal = 0});
  world.response = [](double share) { return std::pow(share, 1 / 2.2); };
  Ladder ladder;
  ladder.shares = {0.05, 0.1, 0.2, 0.35, 0.5, 0.65};
  const auto found = measure(world, ladder);
  ASSERT_TRUE(found.ok()) << found.error().line();
  EXPECT_FALSE(found->linearity.linear(0.05)) << found->linearity.worst;
  ASSERT_TRUE(found->response);
  const ResponseCurve& curve = *found->response;
  const double unit = curve(200) / std::pow(200 / 255.0, 2.2);
  for (const int code : {80, 120, 160, 230})
    EXPECT_NEAR(curve(code) / unit / std::pow(code / 255.0, 2.2), 1, 0.08) << code;
}

// A camera that averages neighbours in time: the second frame is the first one.
TEST(SceneSensor, frames_that_are_not_raw_are_refused) {
  World world;
  SceneTransfer transfer(kGrid, 12);
  ASSERT_TRUE(transfer.begin({false, 20us}).ok());
  for (int k = 0; k < 2; ++k)
    ASSERT_TRUE(transfer.add(world.frame(false, 20us), world.frame(false, 20us)).ok());
  for (const Nanoseconds exposure : {Nanoseconds(5ms), Nanoseconds(2ms), Nanoseconds(6ms)}) {
    ASSERT_TRUE(transfer.begin({true, exposure}).ok());
    const auto frame = world.frame(true, exposure);
    for (int k = 0; k < 2; ++k) ASSERT_TRUE(transfer.add(frame, frame).ok());
  }
  const auto found = transfer.finish();
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::bad_value);
  EXPECT_NE(found.error().what.find("noise"), std::string::npos) << found.error().what;
}

TEST(SceneSensor, no_light_is_told) {
  World world;
  world.lamp = 0.0001;
  const auto found = measure(world);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::bad_value);
}

TEST(SceneSensor, levels_have_an_order) {
  World world;
  const auto dark = world.frame(false, 20us);
  SceneTransfer transfer(kGrid, 12);
  EXPECT_EQ(transfer.add(dark, dark).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(transfer.begin({false, 0ns}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(transfer.begin({true, 1ms}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(transfer.finish().error().code, ErrorCode::bad_argument);
  ASSERT_TRUE(transfer.begin({false, 20us}).ok());
  ASSERT_TRUE(transfer.add(dark, dark).ok());
  EXPECT_EQ(transfer.begin({false, 10us}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(transfer.begin({true, 1ms}).error().code,
            ErrorCode::bad_argument);  // four dark frames are needed
  ASSERT_TRUE(transfer.add(dark, dark).ok());
  EXPECT_EQ(transfer.add(std::span(dark).first(7), dark).error().code, ErrorCode::size_mismatch);
  ASSERT_TRUE(transfer.begin({true, 1ms}).ok());
  EXPECT_EQ(transfer.begin({false, 1ms}).error().code, ErrorCode::bad_argument);
  std::vector<std::uint16_t> large = dark;
  large[3] = 4096;
  EXPECT_EQ(transfer.add(dark, large).error().code, ErrorCode::bad_value);
}

}  // namespace
}  // namespace symrig::scene_sensor_test
