// SPDX-License-Identifier: Apache-2.0
// symrig calibrate --sensor: from frames on the disk to a sensor that rigs and captures use.
#include "symrig/hdr/sensor.hpp"

#include "command.hpp"
#include "symrig/hdr/response_file.hpp"
#include "symrig/image/file.hpp"
#include "unit/hdr/simulated_sensor.hpp"

#include <cmath>
#include <functional>

#include <fmt/format.h>

namespace symrig::test::sensor_test {
namespace {

/// Frames of a simulated sensor, written as 16-bit PNG, and the capture.toml that names them.
class SensorFolder : public CommandTest {
 protected:
  static constexpr Grid kGrid{160, 160};

  void SetUp() override {
    std::filesystem::create_directory(path("frames"));
    toml_ = "symrig = 1\n[sensor]\nbits = 12\n";
  }

  /// electrons: of pixel i.
  void write_frame(const std::string& name, const std::function<double(std::size_t)>& electrons,
                   const std::function<double(double)>& processed = {}) {
    Image<float> image(kGrid);
    for (std::size_t i = 0; i < image.values().size(); ++i) {
      double code = sample(sensor_, electrons(i), random_);
      if (processed) code = std::round(4095 * processed(code / 4095));
      image.values()[i] = static_cast<float>(code) / 65'535.F;
    }
    ASSERT_TRUE(write_image(path("frames/" + name), image).ok());
  }
  void write_dark_and_flat() {
    std::string dark;
    for (int k = 0; k < 6; ++k) {
      const std::string name = fmt::format("dark{}.png", k);
      write_frame(name, [](std::size_t) { return 0.0; });
      dark += fmt::format("\"{}\", ", name);
    }
    toml_ += "dark = [" + dark + "]\n";
    for (const double level : {0.1, 0.25, 0.4, 0.55, 0.7}) {
      const std::string name = fmt::format("flat{:.2f}", level);
      for (const char* each : {"a", "b"})
        write_frame(name + each + ".png", [&](std::size_t) { return level * sensor_.full_well(); });
      toml_ += fmt::format("[[sensor.flat]]\nfiles = [\"{0}a.png\", \"{0}b.png\"]\n", name);
    }
  }
  /// A scene of all shades, at exposures twice as long from one to the next.
  void write_bracket(const std::function<double(double)>& processed = {}) {
    for (int k = 0; k < 4; ++k) {
      const std::string name = fmt::format("still{}.png", k);
      write_frame(
          name,
          [&](std::size_t i) {
            const double shade = static_cast<double>(1 + i % 997) / 997;
            return 0.12 * shade * (1 << k) * sensor_.full_well();
          },
          processed);
      toml_ += fmt::format("[[sensor.bracket]]\nfile = \"{}\"\nexposure = \"{} ms\"\n", name, 5 << k);
    }
  }
  void write_toml() const { write_text(path("frames/capture.toml"), toml_); }

  NoiseModel sensor_ = NoiseModel::from_electrons({});
  Random random_{31};
  std::string toml_;
};

// 25,600 pixels: five pairs of flat frames and three of dark ones know gain and read noise to 0.5 % (one
// sigma), so that 3 % and 5 % are many of them (hdr/sensor.hpp).
TEST_F(SensorFolder, gain_and_read_noise_are_recovered) {
  write_dark_and_flat();
  write_bracket();
  write_toml();
  const Outcome outcome =
      symrig({"calibrate", "--sensor", "frames", "-o", "sensor.toml", "--json", "s.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("gain"), std::string::npos);
  const auto sensor = load_sensor(path("sensor.toml"));
  ASSERT_TRUE(sensor.ok()) << sensor.error().line();
  EXPECT_NEAR(sensor->noise.gain() / sensor_.gain(), 1, 0.03);
  EXPECT_NEAR(sensor->noise.read_noise() / sensor_.read_noise(), 1, 0.05);
  EXPECT_NEAR(sensor->noise.pedestal(), sensor_.pedestal(), 0.05);
  const nlohmann::json j = json("s.json");
  EXPECT_EQ(j.at("dark_frames"), 6);
  EXPECT_EQ(j.at("flat_levels"), 5);
  EXPECT_EQ(j.at("sensor").at("gain"), sensor->noise.gain());
  EXPECT_LT(j.at("sensor").at("gain_sigma").get<double>(), 0.01);
  EXPECT_TRUE(j.at("linearity").at("linear").get<bool>()) << j.dump();
  EXPECT_TRUE(j.at("response").is_null());
}

// A camera that answers with the square root of the light: light of code c is (c / 4095)².
TEST_F(SensorFolder, the_response_of_another_camera_is_written) {
  sensor_ = NoiseModel::from_electrons({.pedestal = 0});
  write_bracket([](double light) { return std::sqrt(light); });
  write_toml();
  const Outcome outcome =
      symrig({"calibrate", "--sensor", "frames", "--response", "response.toml", "--json", "s.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto curve = load_response(path("response.toml"));
  ASSERT_TRUE(curve.ok()) << curve.error().line();
  ASSERT_EQ(curve->light.size(), 4096U);
  // Relative to code 3000, so that what clips at the top does not count.
  const double unit = (*curve)(3000) / std::pow(3000 / 4095.0, 2);
  for (const int code : {1000, 1500, 2000, 2500, 3500})
    EXPECT_NEAR((*curve)(code) / unit / std::pow(code / 4095.0, 2), 1, 0.03) << code;
  EXPECT_LT(json("s.json").at("response").at("doubt").get<double>(), 0.05);
}

TEST_F(SensorFolder, a_camera_that_is_not_linear_is_told) {
  write_dark_and_flat();
  write_bracket([](double light) { return light * (1.1 - 0.1 * light); });
  write_toml();
  const Outcome outcome = symrig({"calibrate", "--sensor", "frames"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("NOT linear"), std::string::npos) << outcome.out;
}

TEST_F(SensorFolder, what_is_not_there_is_named) {
  write_text(path("frames/capture.toml"), "symrig = 1\n");
  expect_refusal({"calibrate", "--sensor", "frames", "-o", "sensor.toml"}, kBadInput, {"no table [sensor]"});
  write_toml();
  expect_refusal({"calibrate", "--sensor", "frames"}, kBadInput, {"names no frames"});
  write_text(path("frames/capture.toml"), toml_ + "dark = [\"dark0.png\"]\n");
  expect_refusal({"calibrate", "--sensor", "frames"}, kBadInput, {"dark0.png"});
  write_text(path("frames/capture.toml"), toml_ + "[[sensor.flat]]\nfile = \"a.png\"\n");
  expect_refusal({"calibrate", "--sensor", "frames"}, kBadInput,
                 {"capture.toml:5", "no key sensor.flat.file; did you mean 'files'?"});
  expect_refusal({"calibrate", "--sensor", "frames", "--from", "frames"}, kUsage, {"--sensor"});
  expect_refusal({"calibrate", "--from", "frames", "--response", "r.toml"}, kUsage, {"--response"});
}

TEST_F(SensorFolder, codes_beyond_their_bits_are_refused) {
  write_frame("dark0.png", [](std::size_t) { return 0.0; });
  Image<float> bright(kGrid, 1, 4096.F / 65'535.F);
  ASSERT_TRUE(write_image(path("frames/dark1.png"), bright).ok());
  write_text(path("frames/capture.toml"), toml_ + "dark = [\"dark0.png\", \"dark1.png\"]\n");
  expect_refusal({"calibrate", "--sensor", "frames"}, kBadInput, {"dark1.png", "4096", "12 bits"});
}

}  // namespace
}  // namespace symrig::test::sensor_test
