// SPDX-License-Identifier: Apache-2.0
// symrig calibrate --sensor: from frames on the disk to a sensor that rigs and captures use.
#include "symrig/hdr/sensor.hpp"

#include "sensor_folder.hpp"
#include "symrig/hdr/response_file.hpp"

#include <cmath>

namespace symrig::test::sensor_test {
namespace {

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
  EXPECT_NE(outcome.out.find("clipping at 4095 DN (assumed: no frame saturates)"), std::string::npos)
      << outcome.out;
  const auto sensor = load_sensor(path("sensor.toml"));
  ASSERT_TRUE(sensor.ok()) << sensor.error().line();
  EXPECT_NEAR(sensor->noise.gain() / sensor_.gain(), 1, 0.03);
  EXPECT_NEAR(sensor->noise.read_noise() / sensor_.read_noise(), 1, 0.05);
  EXPECT_NEAR(sensor->noise.pedestal(), sensor_.pedestal(), 0.05);
  const nlohmann::json j = json("s.json");
  EXPECT_EQ(j.at("dark_frames"), 6);
  EXPECT_EQ(j.at("flat_levels"), 5);
  EXPECT_EQ(j.at("sensor").at("gain"), sensor->noise.gain());
  EXPECT_FALSE(j.at("sensor").at("clipping_seen").get<bool>());
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
  EXPECT_FALSE(json("s.json").at("response").at("doubtful").get<bool>());
  EXPECT_EQ(outcome.out.find("warning"), std::string::npos);
}

TEST_F(SensorFolder, two_methods_that_differ_too_much_are_told) {
  sensor_ = NoiseModel::from_electrons({.pedestal = 0});
  write_bracket([](double light) { return std::sqrt(light); }, 0.6);  // the last exposure is not what it says
  write_toml();
  const Outcome outcome =
      symrig({"calibrate", "--sensor", "frames", "--response", "response.toml", "--json", "s.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(json("s.json").at("response").at("doubtful").get<bool>()) << json("s.json").dump();
  EXPECT_NE(outcome.out.find("warning: the two methods may differ by 5"), std::string::npos) << outcome.out;
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
