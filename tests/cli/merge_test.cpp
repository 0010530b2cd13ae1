// SPDX-License-Identifier: Apache-2.0
// symrig merge: photographs of a still scene with their exposures become radiance that scripts can use.
#include "sensor_folder.hpp"
#include "symrig/hdr/response.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace symrig::test::merge_test {
namespace {

class Merge : public SensorFolder {
 protected:
  /// The largest relative departure of the radiance from the scene's shades, scale removed, where it is valid
  /// and not among the darkest tenth.
  double departure(const std::string& file) const {
    const auto picture = read_image(path(file));
    EXPECT_TRUE(picture.ok());
    double sum = 0, shades = 0, worst = 0;
    const auto values = picture->values();
    for (std::size_t i = 0; i < values.size(); ++i) sum += static_cast<double>(values[i]), shades += shade(i);
    for (std::size_t i = 0; i < values.size(); ++i)
      if (shade(i) > 0.1)
        worst = std::max(worst, std::abs(static_cast<double>(values[i]) / shade(i) * shades / sum - 1));
    return worst;
  }
};

TEST_F(Merge, a_linear_camera_gives_electrons_per_second_with_a_variance_that_holds) {
  write_dark_and_flat();
  write_bracket();
  write_toml();
  const Outcome outcome = symrig(
      {"merge", "frames", "-o", "r.exr", "--variance", "v.exr", "--valid", "valid.png", "--json", "m.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("by a linear sensor"), std::string::npos) << outcome.out;
  const nlohmann::json j = json("m.json");
  EXPECT_EQ(j.at("units"), "electrons per second");
  EXPECT_EQ(j.at("frames").size(), 4U);
  EXPECT_EQ(j.at("frames").at(3).at("exposure"), 0.04);
  EXPECT_TRUE(j.at("linear").get<bool>());
  EXPECT_TRUE(j.at("warnings").empty());
  const auto mean = read_image(path("r.exr")), variance = read_image(path("v.exr")),
             valid = read_image(path("valid.png"));
  ASSERT_TRUE(mean.ok() && variance.ok() && valid.ok());
  double squares = 0, n = 0;
  for (std::size_t i = 0; i < mean->values().size(); ++i) {
    if (valid->values()[i] < 0.5F) continue;
    const double truth = 0.12 * shade(i) * sensor_.full_well() / 5e-3;
    // The gain is measured to 0.5 %: less than the noise of 2 % and more of these pixels.
    if (shade(i) > 0.2) continue;
    squares += std::pow(static_cast<double>(mean->values()[i]) - truth, 2) /
               static_cast<double>(variance->values()[i]);
    ++n;
  }
  ASSERT_GT(n, 4000);
  // Of the scatter √(2 / n), five, and 0.5 % of a truth that is known to 1.5 % at the best: a ninth of σ².
  EXPECT_NEAR(squares / n, 1, 5 * std::sqrt(2 / n) + 0.15);
}

TEST_F(Merge, another_camera_is_merged_by_its_response) {
  sensor_ = NoiseModel::from_electrons({.pedestal = 0});
  write_bracket([](double light) { return std::sqrt(light); });
  write_toml();
  const Outcome outcome = symrig({"merge", "frames", "-o", "r.exr", "--json", "m.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const nlohmann::json j = json("m.json");
  EXPECT_FALSE(j.at("linear").get<bool>());
  EXPECT_EQ(j.at("units"), "light of the largest code per second");
  // The curve is known to 3 % of each code (sensor_test.cpp), and a pixel's noise is 1 to 3 % here, at five
  // sigmas.
  EXPECT_LT(departure("r.exr"), 0.03 + 5 * 0.03);
  EXPECT_GT(j.at("valid_share").get<double>(), 0.95);
  EXPECT_TRUE(j.at("warnings").empty()) << j.at("warnings");

  ASSERT_EQ(symrig({"calibrate", "--sensor", "frames", "--response", "response.toml"}).code, 0);
  const Outcome given = symrig({"merge", "frames", "--response", "response.toml", "-o", "given.exr"});
  ASSERT_EQ(given.code, 0) << given.err;
  EXPECT_NE(given.out.find("by the given response curve"), std::string::npos);
  // The same curve, written in decimal digits that give it back exactly.
  const auto recovered = read_image(path("r.exr")), again = read_image(path("given.exr"));
  for (std::size_t i = 0; i < again->values().size(); ++i)
    ASSERT_NEAR(again->values()[i], recovered->values()[i], 1e-5F * std::abs(recovered->values()[i]));
}

TEST_F(Merge, colours_stay_colours) {
  // Red has all of the light of a shade, green half, blue a quarter, in a camera that answers with the square
  // root.
  sensor_ = NoiseModel::from_electrons({.pedestal = 0});
  for (int k = 0; k < 4; ++k) {
    Image<float> image(kGrid, 3);
    for (int channel = 0; channel < 3; ++channel)
      for (std::size_t i = 0; i < kGrid.size(); ++i) {
        const double light = 0.12 * shade(i) * (1 << k) / (1 << channel);
        const double code = sample(sensor_, light * sensor_.full_well(), random_);
        image.plane(channel)[i] = static_cast<float>(std::round(4095 * std::sqrt(code / 4095))) / 65'535.F;
      }
    const std::string name = fmt::format("colour{}.png", k);
    ASSERT_TRUE(write_image(path("frames/" + name), image).ok());
    toml_ += fmt::format("[[sensor.bracket]]\nfile = \"{}\"\nexposure = \"{} ms\"\n", name, 5 << k);
  }
  write_toml();
  const Outcome outcome = symrig({"merge", "frames", "-o", "r.exr", "--json", "m.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(json("m.json").at("channels"), 3);
  const auto merged = read_image(path("r.exr"));
  ASSERT_EQ(merged->channels(), 3);
  // Of sums of 25,600 pixels nothing but the curve's error is left: 3 % of each code (sensor_test.cpp).
  const auto all = [&](int channel) {
    double sum = 0;
    for (const float v : merged->plane(channel)) sum += static_cast<double>(v);
    return sum;
  };
  EXPECT_NEAR(all(1) / all(0), 0.5, 0.03);
  EXPECT_NEAR(all(2) / all(0), 0.25, 0.03);
}

TEST_F(Merge, an_exposure_that_the_photographs_contradict_is_refused) {
  write_dark_and_flat();
  write_bracket({}, 0.8);
  write_toml();
  expect_refusal({"merge", "frames", "-o", "r.exr"}, kBadInput,
                 {"still3.png has 1.6 times the light of still2.png by its pixels, 2 times by its exposure",
                  "--unchecked"});
  const Outcome outcome = symrig({"merge", "frames", "-o", "r.exr", "--json", "m.json", "--unchecked"});
  ASSERT_EQ(outcome.code, 0);
  EXPECT_NE(
      outcome.err.find(
          "warning: still3.png has 1.6 times the light of still2.png by its pixels, 2 times by its exposure"),
      std::string::npos)
      << outcome.err;
  EXPECT_EQ(json("m.json").at("warnings").size(), 1U);
  EXPECT_TRUE(json("m.json").at("ratios").at(2).at("wrong").get<bool>());
}

TEST_F(Merge, an_exposure_that_is_wrong_by_little_is_named) {
  write_dark_and_flat();
  write_bracket({}, 0.94);  // as 1/60 s, which is 1/64 s
  write_toml();
  const Outcome outcome = symrig({"merge", "frames", "-o", "r.exr", "--json", "m.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("warning: still3.png has 1.88 times the light of still2.png"), std::string::npos)
      << outcome.err;
}

TEST_F(Merge, a_bracket_without_light_is_refused) {
  write_dark_and_flat();
  for (int k = 0; k < 3; ++k) {
    write_frame(fmt::format("black{}.png", k), [](std::size_t) { return 0.0; });
    toml_ += fmt::format("[[sensor.bracket]]\nfile = \"black{}.png\"\nexposure = \"{} ms\"\n", k, 5 << k);
  }
  write_toml();
  expect_refusal({"merge", "frames", "-o", "r.exr"}, kBadInput, {"light"});
}

/// Two measurements of one scene with other noise differ as their variances say.
TEST_F(Merge, frames_that_a_rig_took_of_a_scene_measure_the_camera_and_are_merged) {
  const auto merged = [&](const std::string& seed) {
    const std::string kept = "kept" + seed, picture = "r" + seed + ".exr", variance = "v" + seed + ".exr";
    EXPECT_EQ(symrig({"calibrate", "--sensor", "--rig", "sim:vgroove-textured?size=64x64&noise_seed=" + seed,
                      "--keep", kept, "-o", "sensor" + seed + ".toml"})
                  .code,
              0);
    const Outcome outcome =
        symrig({"merge", kept, "-o", picture, "--variance", variance, "--json", "m" + seed + ".json"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    const nlohmann::json j = json("m" + seed + ".json");
    EXPECT_EQ(j.at("units"), "electrons per second");
    EXPECT_GT(j.at("frames").size(), 10U);
    return std::pair(read_image(path(picture)), read_image(path(variance)));
  };
  const auto [first, first_variance] = merged("1");
  const auto [second, second_variance] = merged("2");
  ASSERT_TRUE(first.ok() && second.ok() && first_variance.ok() && second_variance.ok());
  // Each measures the gain for itself, so one factor between the two is unknown.
  double sum = 0, other = 0;
  for (const float value : first->values()) sum += static_cast<double>(value);
  for (const float value : second->values()) other += static_cast<double>(value);
  EXPECT_NEAR(sum / other, 1, 0.03);
  double squares = 0;
  const auto pixels = first->values().size();
  for (std::size_t i = 0; i < pixels; ++i) {
    const double scale = sum / other, difference = static_cast<double>(first->values()[i]) -
                                                   scale * static_cast<double>(second->values()[i]);
    squares += difference * difference /
               (static_cast<double>(first_variance->values()[i]) +
                scale * scale * static_cast<double>(second_variance->values()[i]));
  }
  // Five sigmas of the scatter √(2 / n), and 3 % of either gain.
  const auto n = static_cast<double>(pixels);
  EXPECT_NEAR(squares / n, 1, 5 * std::sqrt(2 / n) + 0.03);
}

// calibrate tells the flicker of a lamp. It makes no exposure wrong.
TEST_F(Merge, a_lamp_that_flickers_contradicts_no_exposure) {
  ASSERT_EQ(symrig({"calibrate", "--sensor", "--rig", "sim:vgroove-textured?size=64x64", "--keep", "kept",
                    "-o", "sensor.toml"})
                .code,
            0);
  constexpr double kPedestal = 64, kFlicker = 0.008;  // the limit of a wrong exposure is 0.005
  for (const auto& entry : std::filesystem::directory_iterator(path("kept"))) {
    const std::filesystem::path& file = entry.path();
    if (!file.filename().string().starts_with("lit")) continue;
    // The frames of an exposure are numbered: even ones are brighter, odd ones darker.
    const double sign = (file.stem().string().back() - '0') % 2 == 0 ? 1 : -1;
    std::string bytes = read_text(file.string());
    for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
      const int code = static_cast<unsigned char>(bytes[i]) + 256 * static_cast<unsigned char>(bytes[i + 1]);
      const auto lit = static_cast<int>(
          std::clamp(std::round(kPedestal + (code - kPedestal) * (1 + sign * kFlicker)), 0.0, 4095.0));
      bytes[i] = static_cast<char>(lit % 256), bytes[i + 1] = static_cast<char>(lit / 256);
    }
    write_text(file.string(), bytes);
  }
  const Outcome outcome =
      symrig({"merge", "kept", "-o", "r.exr", "--sensor", "sensor.toml", "--json", "m.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_GT(json("m.json").at("ratios").size(), 3U);

  // A wrong exposure is still told.
  std::string toml = read_text(path("kept/capture.toml"));
  const std::string key = "exposure = \"";
  const std::size_t at = toml.find(key, toml.find("[[sensor.flat]]")) + key.size();
  const std::string stated = toml.substr(at, toml.find('"', at) - at);
  std::size_t unit = 0;
  const double number = std::stod(stated, &unit);
  const std::string wrong = fmt::format("{:.3f}{}", 1.2 * number, stated.substr(unit));
  for (std::size_t k = toml.find(stated); k != std::string::npos; k = toml.find(stated, k + wrong.size()))
    toml.replace(k, stated.size(), wrong);
  write_text(path("kept/capture.toml"), toml);
  expect_refusal({"merge", "kept", "-o", "told.exr", "--sensor", "sensor.toml"}, kBadInput,
                 {"times the light of"});
}

TEST_F(Merge, what_cannot_be_merged_is_refused_before_anything_is_written) {
  expect_refusal({"merge", "frames", "-o", "r.exr"}, kBadInput, {"capture.toml"});
  write_text(path("frames/capture.toml"), "symrig = 1\n");
  expect_refusal({"merge", "frames", "-o", "r.exr"}, kBadInput, {"no table [sensor]"});
  write_text(path("frames/capture.toml"), "symrig = 1\n[sensor]\nbits = 12\n");
  expect_refusal({"merge", "frames", "-o", "r.exr"}, kBadInput,
                 {"fewer than two exposures", "[[sensor.bracket]]"});
  write_bracket();
  write_toml();
  write_text(path("sensor.toml"), "[sensor]\nbits = 10\npedestal = 64\ngain = 0.2\nread_noise = 6\n");
  expect_refusal({"merge", "frames", "-o", "r.exr", "--sensor", "sensor.toml"}, kBadInput, {"10 bits", "12"});
  write_text(
      path("sensor.toml"),
      "[sensor]\nbits = 12\npedestal = 64\ngain = 0.2\nread_noise = 6\ngrid = [9, 9]\ndefects = [[1, 2]]\n");
  expect_refusal({"merge", "frames", "-o", "r.exr", "--sensor", "sensor.toml"}, kBadInput,
                 {"9x9", "160x160"});
  ResponseCurve eight;
  for (int code = 0; code < 256; ++code) eight.light.push_back(code / 255.0);
  ASSERT_TRUE(save_response(path("response.toml"), eight).ok());
  expect_refusal({"merge", "frames", "-o", "r.exr", "--response", "response.toml"}, kBadInput,
                 {"256 codes", "12 bits"});
  expect_refusal({"merge", "frames", "-o", "r.tif"}, kUsage, {"r.tif"});
  expect_refusal({"merge", "frames", "-o", "r.exr", "--variance", "v.png"}, kUsage, {"v.png", "variance"});
  expect_refusal({"merge", "frames", "-o", "r.exr", "--sensor", "a", "--response", "b"}, kUsage,
                 {"--response"});
  expect_refusal({"merge", "frames"}, kUsage, {"--output"});
  Image<float> smaller({10, 10});
  ASSERT_TRUE(write_image(path("frames/still2.png"), smaller).ok());
  expect_refusal({"merge", "frames", "-o", "r.exr"}, kBadInput, {"still2.png is 10x10"});
}

}  // namespace
}  // namespace symrig::test::merge_test
