// SPDX-License-Identifier: Apache-2.0
// Photon transfer on simulated sensors: gain, read noise, non-uniformity, defects; and sensor.toml.
#include "symrig/hdr/sensor.hpp"

#include "simulated_sensor.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

namespace symrig::sensor_test {
namespace {

constexpr Grid kGrid{128, 128};
constexpr std::size_t kPixels = std::size_t{128} * 128;

/// A sensor with everything wrong that sensors have.
struct World {
  NoiseModel noise = NoiseModel::from_electrons({});
  double prnu = 0, dsnu = 0;  // relative, DN
  double flicker = 0;         // relative, from frame to frame
  std::array<double, 4> mosaic{1, 1, 1, 1};
  std::vector<double> gains, offsets;
  std::vector<std::size_t> hot, dead;
  test::Random random{7};

  void make_pixels() {
    for (std::size_t i = 0; i < kPixels; ++i) {
      gains.push_back(1 + prnu * random.normal());
      offsets.push_back(dsnu * random.normal());
    }
    for (std::size_t i = 0; i < kPixels; ++i) gains[i] *= mosaic[i / 128 % 2 * 2 + i % 2];
    for (const std::size_t i : dead) gains[i] = 0.02;
    for (const std::size_t i : hot) offsets[i] = 400;
  }
  /// Light falls off to the corners by a fifth, as through a lens.
  std::vector<std::uint16_t> frame(double electrons) {
    std::vector<std::uint16_t> codes;
    const double lamp = 1 + flicker * random.normal();
    for (std::size_t i = 0; i < kPixels; ++i) {
      const std::size_t row = i / 128, col = i % 128;
      const double y = static_cast<double>(row) / 64 - 1, x = static_cast<double>(col) / 64 - 1;
      const double mean = electrons * lamp * gains[i] * (1 - 0.1 * (x * x + y * y));
      const double collected = std::min(random.poisson(mean), noise.full_well());
      const double code =
          noise.pedestal() + offsets[i] + noise.gain() * (collected + noise.read_noise() * random.normal());
      codes.push_back(
          static_cast<std::uint16_t>(std::clamp(std::round(code), 0.0, double(noise.max_code()))));
    }
    return codes;
  }
};

struct Taken {
  std::vector<std::vector<std::uint16_t>> dark;
  std::vector<std::vector<std::vector<std::uint16_t>>> flat;
  int bits;

  SensorFrames frames() const {
    SensorFrames all{kGrid, bits, {dark.begin(), dark.end()}, {}};
    for (const auto& level : flat) all.flat.emplace_back(level.begin(), level.end());
    return all;
  }
};

Taken take(World& world, int dark, int each, const std::vector<double>& levels) {
  Taken taken{{}, {}, world.noise.bits()};
  for (int k = 0; k < dark; ++k) taken.dark.push_back(world.frame(0));
  for (const double level : levels) {
    taken.flat.emplace_back();
    for (int k = 0; k < each; ++k) taken.flat.back().push_back(world.frame(level * world.noise.full_well()));
  }
  return taken;
}

const std::vector<double> kLevels{0.1, 0.2, 0.35, 0.5, 0.65};

class Recovered : public testing::TestWithParam<NoiseModel::Electrons> {};

TEST_P(Recovered, GainWithin3AndReadNoiseWithin5PercentByThePromisedNumberOfFrames) {
  World world;
  world.noise = NoiseModel::from_electrons(GetParam());
  world.make_pixels();
  // Five sigmas must lie within the bars.
  const FramesNeeded needed = frames_needed(kGrid.size(), 0.03 / 5, 0.05 / 5);
  const Taken taken = take(world, needed.dark, 2 * needed.flat_pairs, kLevels);
  const auto sensor = measure_sensor(taken.frames());
  ASSERT_TRUE(sensor.ok()) << sensor.error().line();
  EXPECT_NEAR(sensor->noise.gain() / world.noise.gain(), 1, 0.03);
  EXPECT_NEAR(sensor->noise.read_noise() / world.noise.read_noise(), 1, 0.05);
  // and it says itself how far it may be off
  EXPECT_NEAR(sensor->noise.gain() / world.noise.gain(), 1, 5 * sensor->gain_sigma);
  EXPECT_NEAR(sensor->noise.read_noise() / world.noise.read_noise(), 1, 5 * sensor->read_noise_sigma);
  EXPECT_LE(sensor->gain_sigma, 0.03 / 5);
  EXPECT_NEAR(sensor->noise.pedestal(), world.noise.pedestal(), 0.1);
}
INSTANTIATE_TEST_SUITE_P(
    Sensors, Recovered,
    testing::Values(NoiseModel::Electrons{},
                    NoiseModel::Electrons{.full_well = 10'000, .read_noise = 3, .bits = 14},
                    NoiseModel::Electrons{.full_well = 40'000, .read_noise = 25, .bits = 12},
                    NoiseModel::Electrons{.full_well = 15'000, .read_noise = 8, .bits = 10, .pedestal = 32}));

TEST(Sensor, FlickerNonUniformityAndDefectsDoNotMoveGainAndReadNoise) {
  World world;
  world.prnu = 0.01;
  world.dsnu = 1.5;
  world.flicker = 0.05;
  world.hot = {5, 777, 9000};
  world.dead = {40, 1234};
  world.make_pixels();
  const auto sensor = measure_sensor(take(world, 16, 8, kLevels).frames());
  ASSERT_TRUE(sensor.ok()) << sensor.error().line();
  EXPECT_NEAR(sensor->noise.gain() / world.noise.gain(), 1, 0.03);
  EXPECT_NEAR(sensor->noise.read_noise() / world.noise.read_noise(), 1, 0.05);
  // Estimated from 16,384 pixels: √(1 / (2 n)) = 0.6 %; what is subtracted for noise adds to that.
  EXPECT_NEAR(sensor->prnu, 0.01, 0.001);
  EXPECT_NEAR(sensor->dsnu, 1.5, 0.1);
  for (const std::size_t i : {5, 777, 9000, 40, 1234})
    EXPECT_EQ(sensor->defects.values()[i], 1) << "pixel " << i;
  EXPECT_EQ(std::count(sensor->defects.values().begin(), sensor->defects.values().end(), 1), 5);
}

TEST(Sensor, AWhiteLevelBelowTheLargestCodeIsFound) {
  World world;
  world.noise = NoiseModel::from_electrons({.full_well = 20'000, .bits = 12}).clipped_at(3600);
  world.make_pixels();
  std::vector<double> levels = kLevels;
  levels.push_back(1.6);
  const auto sensor = measure_sensor(take(world, 4, 2, levels).frames());
  ASSERT_TRUE(sensor.ok()) << sensor.error().line();
  // The full well clips electrons before read noise is added: the pile is a few codes wide.
  EXPECT_LE(sensor->noise.saturation_code(), 3600 + 3);
  EXPECT_TRUE(sensor->clipping_seen);
}

// Light falls off by a fifth to the corners, so only the middle of the brightest level clips.
TEST(Sensor, AFlatThatClipsInPartTellsTheWhiteLevelToo) {
  for (const int clip : {3600, 4095}) {
    World world;
    world.noise = NoiseModel::from_electrons({.full_well = 20'000, .bits = 12}).clipped_at(clip);
    world.make_pixels();
    std::vector<double> levels = kLevels;
    levels.push_back(1.06);
    const auto sensor = measure_sensor(take(world, 4, 2, levels).frames());
    ASSERT_TRUE(sensor.ok()) << sensor.error().line();
    EXPECT_TRUE(sensor->clipping_seen) << clip;
    EXPECT_NEAR(sensor->noise.clipping_code(), clip, 3);
    EXPECT_NEAR(sensor->noise.gain() / world.noise.gain(), 1, 0.03);
    const auto unseen = measure_sensor(take(world, 4, 2, kLevels).frames());
    ASSERT_TRUE(unseen.ok());
    EXPECT_FALSE(unseen->clipping_seen);
    EXPECT_EQ(unseen->noise.clipping_code(), 4095);
  }
}

// The flats of a sensor with colour filters: red and blue see half of what green sees.
TEST(Sensor, AMosaicHasNoMoreDefectsThanAGreySensor) {
  World world;
  world.prnu = 0.01;
  world.mosaic = {0.55, 1, 1, 0.4};
  world.hot = {5, 777, 9000};
  world.dead = {40, 1234};
  world.make_pixels();
  const auto sensor = measure_sensor(take(world, 16, 8, kLevels).frames());
  ASSERT_TRUE(sensor.ok()) << sensor.error().line();
  EXPECT_NEAR(sensor->noise.gain() / world.noise.gain(), 1, 0.03);
  EXPECT_NEAR(sensor->noise.read_noise() / world.noise.read_noise(), 1, 0.05);
  EXPECT_NEAR(sensor->prnu, 0.01, 0.001);
  EXPECT_EQ(std::count(sensor->defects.values().begin(), sensor->defects.values().end(), 1), 5);
}

TEST(Sensor, FlatsWithStructureAreRefused) {
  World world;
  world.make_pixels();
  for (std::size_t i = 0; i < kPixels; ++i)
    if (i / 128 % 3 == 0) world.gains[i] = 0.2;
  const auto sensor = measure_sensor(take(world, 4, 2, kLevels).frames());
  ASSERT_FALSE(sensor.ok());
  EXPECT_NE(sensor.error().what.find("respond unlike their neighbours"), std::string::npos)
      << sensor.error().line();
}

// The read noise is 6 e- = 1.2 DN.
TEST(Sensor, ABlackLevelThatIsCutAtZeroIsRefused) {
  for (const double pedestal : {0.0, 1.0, 4.0, 64.0}) {
    World world;
    world.noise = NoiseModel::from_electrons({.pedestal = pedestal});
    world.make_pixels();
    const auto sensor = measure_sensor(take(world, 4, 2, kLevels).frames());
    EXPECT_EQ(sensor.ok(), pedestal >= 4) << pedestal;
    if (sensor.ok())
      EXPECT_NEAR(sensor->noise.read_noise() / 6, 1, 0.05);
    else
      EXPECT_NE(sensor.error().what.find("cut at code 0"), std::string::npos) << sensor.error().line();
  }
}

TEST(Sensor, SaysWhatIsWrongWithTheFrames) {
  World world;
  world.make_pixels();
  const Taken good = take(world, 2, 2, {0.3});
  auto frames = good.frames();
  frames.dark.resize(1);
  EXPECT_EQ(measure_sensor(frames).error().code, ErrorCode::bad_argument);
  frames = good.frames();
  frames.flat[0].resize(1);
  EXPECT_EQ(measure_sensor(frames).error().code, ErrorCode::bad_argument);
  frames = good.frames();
  frames.flat[0] = frames.dark;  // the lamp was off
  EXPECT_EQ(measure_sensor(frames).error().code, ErrorCode::bad_value);
  frames = good.frames();
  frames.dark[0] = frames.dark[0].first(17);
  EXPECT_EQ(measure_sensor(frames).error().code, ErrorCode::size_mismatch);
  // Frames that were smoothed: their noise does not grow as light does.
  frames = good.frames();
  frames.flat[0][1] = frames.flat[0][0];
  EXPECT_EQ(measure_sensor(frames).error().code, ErrorCode::bad_value);
}

class SensorFile : public testing::Test {
 protected:
  SensorFile() {
    std::string text = (std::filesystem::temp_directory_path() / "symrig-sensor-XXXXXX").string();
    folder_ = mkdtemp(text.data());
  }
  ~SensorFile() override { std::filesystem::remove_all(folder_); }
  Result<Sensor> load(const std::string& text) {
    std::ofstream(path()) << text;
    return load_sensor(path());
  }
  std::filesystem::path path() const { return folder_ / "sensor.toml"; }

 private:
  std::filesystem::path folder_;
};

TEST_F(SensorFile, HoldsWhatWasMeasured) {
  Sensor sensor;
  sensor.noise =
      NoiseModel::from_electrons({.full_well = 12'345, .read_noise = 4.5, .bits = 14}).clipped_at(15'000);
  sensor.gain_sigma = 0.001;
  sensor.read_noise_sigma = 0.002;
  sensor.prnu = 0.0125;
  sensor.dsnu = 1.25;
  sensor.nonlinearity = 0.003;
  sensor.defects = Image<std::uint8_t>({4, 5});
  sensor.defects.at(3, 4) = 1;
  ASSERT_TRUE(save_sensor(path(), sensor).ok());
  const auto read = load_sensor(path());
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_DOUBLE_EQ(read->noise.gain(), sensor.noise.gain());
  EXPECT_NEAR(read->noise.read_noise(), 4.5, 1e-9);
  EXPECT_EQ(read->noise.saturation_code(), sensor.noise.saturation_code());
  EXPECT_EQ(read->noise.bits(), 14);
  EXPECT_EQ(read->defects, sensor.defects);
  EXPECT_EQ(read->prnu, 0.0125);
  EXPECT_EQ(read->gain_sigma, 0.001);
  EXPECT_EQ(read->nonlinearity, 0.003);
}

TEST_F(SensorFile, NamesLineAndKeyOfWhatIsWrong) {
  EXPECT_EQ(load_sensor(path()).error().code, ErrorCode::not_found);
  const auto wrong = [&](const std::string& text) { return load(text).error(); };
  EXPECT_EQ(wrong("[sensor]\nbits = 12\npedestal = 64\n").code, ErrorCode::bad_format);
  EXPECT_NE(wrong("[sensor]\nbits = 12\npedestal = 64\n").what.find("gain"), std::string::npos);
  const Error range = wrong("[sensor]\nbits = 12\npedestal = 64\ngain = 0.2\nread_noise = -6\n");
  EXPECT_NE(range.what.find("sensor.toml:5: sensor.read_noise"), std::string::npos) << range.what;
  EXPECT_NE(wrong("[camera]\n").what.find("there is no key camera"), std::string::npos);
  EXPECT_NE(wrong("").what.find("[sensor]"), std::string::npos);
  EXPECT_EQ(wrong("[sensor\n").code, ErrorCode::bad_format);
  const std::string good = "[sensor]\nbits = 12\npedestal = 64\ngain = 0.2\nread_noise = 6\n";
  ASSERT_TRUE(load(good).ok());
  EXPECT_EQ(wrong(good + "grid = [2, 2]\ndefects = [[2, 0]]\n").code, ErrorCode::bad_format);
}

}  // namespace
}  // namespace symrig::sensor_test
