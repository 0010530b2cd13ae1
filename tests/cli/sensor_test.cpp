// SPDX-License-Identifier: Apache-2.0
// symrig calibrate --sensor: from frames on the disk to a sensor that rigs and captures use.
#include "symrig/hdr/sensor.hpp"

#include "command.hpp"
#include "sensor_folder.hpp"
#include "symrig/hdr/response.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <functional>
#include <string>

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

// symrig calibrate --sensor --rig: the frames come from a rig.

using SensorRig = CommandTest;
using Words = std::vector<std::string>;

constexpr const char* kRig = "sim:vgroove-textured?size=64x64";

// The simulated sensor: docs/command-line.md. tests/unit/rig/sensor_frames_test.cpp judges the stated errors.
TEST_F(SensorRig, a_simulated_rig_tells_its_sensor) {
  const Outcome outcome =
      symrig({"calibrate", "--sensor", "--rig", kRig, "-o", "sensor.toml", "--json", "s.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  for (const char* word : {"sensitivities not measured", "dark signal", "linear"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << outcome.out;
  const auto sensor = load_sensor(path("sensor.toml"));
  ASSERT_TRUE(sensor.ok()) << sensor.error().line();
  EXPECT_NEAR(sensor->noise.full_well() / 20'000, 1, 0.03);
  EXPECT_NEAR(sensor->noise.read_noise() / 6, 1, 0.05);
  EXPECT_NEAR(sensor->noise.pedestal(), 64, 0.05);
  EXPECT_NE(read_text(path("sensor.toml")).find("prnu = 0  # rms, relative, 0: not measured"),
            std::string::npos);
  const nlohmann::json j = json("s.json");
  EXPECT_EQ(j.at("source"), kRig);
  EXPECT_EQ(j.at("sensor").at("gain"), sensor->noise.gain());
  EXPECT_TRUE(j.at("sensor").at("prnu").is_null());
  EXPECT_TRUE(j.at("scene").at("clipping_seen").get<bool>());
  EXPECT_TRUE(j.at("linearity").at("linear").get<bool>());
  EXPECT_GT(j.at("rig_frames").get<int>(), j.at("dark_frames").get<int>());
  EXPECT_GT(j.at("rig_seconds").get<double>(), 0);
  EXPECT_EQ(files(), (std::set<std::string>{"sensor.toml", "s.json"}));
}

TEST_F(SensorRig, kept_frames_measure_the_same_to_the_last_digit) {
  const Outcome from_rig = symrig(
      {"calibrate", "--sensor", "--rig", kRig, "--keep", "frames", "-o", "rig.toml", "--json", "rig.json"});
  ASSERT_EQ(from_rig.code, 0) << from_rig.err;
  const Outcome from_folder =
      symrig({"calibrate", "--sensor", "frames", "-o", "folder.toml", "--json", "folder.json"});
  ASSERT_EQ(from_folder.code, 0) << from_folder.err;
  EXPECT_EQ(read_text(path("rig.toml")), read_text(path("folder.toml")));
  const nlohmann::json rig = json("rig.json"), folder = json("folder.json");
  for (const char* key : {"grid", "dark_frames", "flat_levels", "sensor", "scene", "linearity", "response"})
    EXPECT_EQ(rig.at(key), folder.at(key)) << key;
  // A folder that has been measured is not written over. Merged, its frames tell the same sensor.
  expect_refusal({"calibrate", "--sensor", "--rig", kRig, "--keep", "frames"}, kUsage,
                 {"capture.toml already"});
  const Outcome merged = symrig({"merge", "frames", "-o", "a.exr", "--json", "a.json"});
  ASSERT_EQ(merged.code, 0) << merged.err;
  EXPECT_EQ(json("a.json").at("frames").size(), rig.at("scene").at("lit_frames"));
  ASSERT_EQ(symrig({"merge", "frames", "-o", "b.exr", "--sensor", "rig.toml"}).code, 0);
  const auto found = read_image(path("a.exr")), given = read_image(path("b.exr"));
  ASSERT_TRUE(found.ok() && given.ok());
  EXPECT_TRUE(std::ranges::equal(found->values(), given->values()));
}

TEST_F(SensorRig, a_folder_of_a_scene_has_rules) {
  std::filesystem::create_directory(path("frames"));
  const auto refused = [&](const std::string& more, const Words& words) {
    write_text(path("frames/capture.toml"), "symrig = 1\n[sensor]\nbits = 12\nlight = \"scene\"\n" + more);
    expect_refusal({"calibrate", "--sensor", "frames"}, kBadInput, words);
    expect_refusal({"merge", "frames", "-o", "a.exr"}, kBadInput, words);
  };
  refused("", {"names no frames"});
  refused("[[sensor.dark]]\nfiles = [\"a.png\", \"b.png\"]\n", {"capture.toml:5", "sensor.dark.exposure"});
  refused("[[sensor.dark]]\nfiles = [\"a.png\"]\nexposure = \"1 ms\"\n", {"capture.toml:6", "no pairs"});
  refused("[[sensor.bracket]]\nfile = \"a.png\"\nexposure = \"1 ms\"\n", {"sensor.bracket: has no meaning"});
  refused("[[sensor.flat]]\nfiles = [\"a.png\", \"b.png\"]\nexposure = \"1 ms\"\n", {"a.png"});
  write_text(path("frames/capture.toml"), "symrig = 1\n[sensor]\nbits = 12\nlight = \"sceen\"\n");
  expect_refusal({"calibrate", "--sensor", "frames"}, kBadInput,
                 {"capture.toml:4", "did you mean", "\"scene\""});
}

TEST_F(SensorRig, the_sensor_that_the_rig_file_names_need_not_exist) {
  write_text(
      path("rig.toml"),
      "symrig = 1\n[board]\nuri = \"unix:no-board.sock\"\n[camera]\nsensor = \"sensor.toml\"\n[projector]\n");
  const Outcome capture = symrig({"capture", "--rig", "rig.toml", "-o", "scene.h5"});
  EXPECT_EQ(capture.code, kBadInput) << capture.err;
  EXPECT_NE(capture.err.find("sensor.toml"), std::string::npos) << capture.err;
  expect_refusal({"calibrate", "--sensor", "--rig", "rig.toml"}, 3, {"no-board.sock"});
  write_text(path("rig.toml"),
             "symrig = 1\n[board]\nuri = \"unix:no-board.sock\"\n[camera]\nbinning = 2\n[projector]\n");
  expect_refusal({"calibrate", "--sensor", "--rig", "rig.toml", "-o", "sensor.toml"}, kUsage,
                 {"camera.binning is 2", "single samples"});
  // Only the sensor that it names may be replaced.
  expect_refusal({"calibrate", "--sensor", "--rig", "rig.toml", "-o", "rig.toml"}, kUsage, {"is an input"});
}

TEST_F(SensorRig, what_cannot_be_measured_is_refused_in_a_line) {
  const auto refused = [&](const std::string& rig, int code, const Words& words) {
    expect_refusal({"calibrate", "--sensor", "--rig", rig, "-o", "sensor.toml", "--keep", "frames"}, code,
                   words);
  };
  refused("sim:plane?size=64x64&noise=off", kUsage, {"no noise", "noise=off"});
  refused("sim:plane?size=64x64&channels=3", kUsage, {"codes for 4096 pixels"});
  refused("exec:true", kUsage, {"photographs"});
  refused("sim:plain", kUsage, {"plain", "plane"});
  refused("nothing.toml", kBadInput, {"no rig file"});
  const Outcome drifts =
      symrig({"calibrate", "--sensor", "--rig", "sim:plane?size=64x64&drift=0.5", "-o", "s.toml"});
  EXPECT_EQ(drifts.code, kFault) << drifts.err;
  EXPECT_NE(drifts.err.find("the light changed by"), std::string::npos) << drifts.err;
  EXPECT_TRUE(files().empty());
}

TEST_F(SensorRig, options_that_contradict_are_refused) {
  const Words base{"calibrate", "--sensor"};
  const auto refused = [&](const Words& more, const Words& words) {
    Words all = base;
    all.insert(all.end(), more.begin(), more.end());
    expect_refusal(all, kUsage, words);
  };
  refused({}, {"--sensor is empty", "--rig RIG"});
  refused({"-o", "sensor.toml"}, {"--sensor is empty"});
  refused({"frames", "--rig", kRig}, {"--sensor DIR", "--rig"});
  refused({"--from", "frames"}, {"--sensor"});
  refused({"--rig", kRig, "--levels", "l.toml"}, {"two measurements"});
  refused({"--rig", kRig, "--report", "m.html"}, {"--report has no effect"});
  refused({"--rig", kRig, "-o", "sensor.h5"}, {".toml"});
  refused({"frames", "--keep", "more"}, {"--keep needs --sensor and --rig"});
  expect_refusal({"calibrate", "--rig", kRig, "--keep", "more"}, kUsage, {"--keep needs --sensor"});
  expect_refusal({"calibrate", "--rig", kRig, "--sensor", "--response", "sensor.json"}, kUsage, {".toml"});
}

/// Frames of a scene, written by hand.
class SceneFolder : public SensorFolder {
 protected:
  /// The second frame of a pair is brighter by the flicker.
  void write_level(const char* kind, const std::string& name, double share, int frames) {
    std::string files;
    for (int k = 0; k < frames; ++k) {
      const std::string file = fmt::format("{}-{}.png", name, k);
      const double light = share * (k % 2 == 0 ? 1 : 1 + flicker_) * 1.2;
      write_frame(
          file, [&](std::size_t i) { return light * shade(i) * sensor_.full_well(); }, processed_);
      files += fmt::format("\"{}\", ", file);
    }
    const int us = share == 0 ? 20 : static_cast<int>(std::lround(10'000 * share));
    toml_ += fmt::format("[[sensor.{}]]\nfiles = [{}]\nexposure = \"{} us\"\n", kind, files, us);
  }
  void write_levels() {
    toml_ += "light = \"scene\"\n";
    write_level("dark", "dark", 0, 4);
    int level = 0;
    for (const double share : {0.4, 0.1, 0.2, 0.4, 0.6})
      write_level("flat", fmt::format("lit{}", level++), share, 2);
    write_toml();
  }

  double flicker_ = 0;
  std::function<double(double)> processed_;
};

TEST_F(SceneFolder, steady_light_gives_no_warning) {
  write_levels();
  const Outcome outcome = symrig({"calibrate", "--sensor", "frames"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("warning"), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.out.find("dark signal"), std::string::npos) << outcome.out;  // it has one dark level
}

TEST_F(SceneFolder, light_that_flickers_is_told) {
  flicker_ = 0.02;  // 1.4 % rms
  write_levels();
  const Outcome outcome = symrig({"calibrate", "--sensor", "frames", "-o", "sensor.toml"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("flickers by more than 1.0 %"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("light_period"), std::string::npos) << outcome.out;
  const auto sensor = load_sensor(path("sensor.toml"));
  ASSERT_TRUE(sensor.ok()) << sensor.error().line();
  EXPECT_NEAR(sensor->noise.gain() / sensor_.gain(), 1, 5 * sensor->gain_sigma);
}

// A camera that answers with the square root of the light: light of code c is (c / 4095)².
TEST_F(SceneFolder, a_gamma_has_no_sensor_but_a_response) {
  sensor_ = NoiseModel::from_electrons({.pedestal = 0});
  processed_ = [](double light) { return std::sqrt(light); };
  write_levels();
  expect_refusal({"calibrate", "--sensor", "frames", "-o", "sensor.toml"}, kBadInput,
                 {"not linear", "gamma"});
  const Outcome outcome = symrig({"calibrate", "--sensor", "frames", "--response", "response.toml"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("NOT linear"), std::string::npos) << outcome.out;
  const auto curve = load_response(path("response.toml"));
  ASSERT_TRUE(curve.ok()) << curve.error().line();
  const double unit = (*curve)(2500) / std::pow(2500 / 4095.0, 2);
  for (const int code : {1500, 2000, 3000})
    EXPECT_NEAR((*curve)(code) / unit / std::pow(code / 4095.0, 2), 1, 0.05) << code;
}

TEST_F(SensorRig, ctrl_c_stops_it_and_leaves_no_result) {
  Running running(path("."), {"calibrate", "--sensor", "--rig", "sim:gummy?size=512x512", "--keep", "frames",
                              "-o", "sensor.toml"});
  if (!running.works(SIGINT, 0.1)) GTEST_SKIP() << "it had ended before the signal";
  running.signal(SIGINT);
  const Outcome outcome = running.wait();
  EXPECT_EQ(outcome.code, kFault) << outcome.err;
  EXPECT_NE(outcome.err.find("stopped after"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(path("sensor.toml")));
  EXPECT_FALSE(std::filesystem::exists(path("frames/capture.toml")));
}

}  // namespace
}  // namespace symrig::test::sensor_test
