// SPDX-License-Identifier: Apache-2.0
// A bracket of a camera that is not linear becomes radiance whose variance holds.
#include "scratch.hpp"
#include "simulated_sensor.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/projector/projector.hpp"

#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::response_merge_test {
namespace {

using namespace std::chrono_literals;

constexpr double kGamma = 2.2, kFull = 0.1;  // light that gives code 255 in one second
constexpr Grid kGrid{150, 200};

ResponseCurve true_curve() {
  ResponseCurve curve;
  for (int c = 0; c < 256; ++c) curve.light.push_back(std::pow(c / 255.0, kGamma));
  return curve;
}

/// An 8-bit camera: code 255 (light)^(1/γ) plus noise that grows with the code.
struct Camera {
  std::vector<std::vector<std::uint16_t>> codes{};
  std::vector<Nanoseconds> exposures{};
  std::vector<double> scene{};
  test::Random random{11};

  static double sigma(double code) { return 0.6 + 1.2 * code / 255; }
  /// What a code varies by, rounding included.
  static double variance(double code) { return sigma(code) * sigma(code) + 1.0 / 12; }

  Camera() {
    for (std::int64_t i = 0; i < static_cast<std::int64_t>(kGrid.size()); ++i)
      scene.push_back(std::pow(10, -2 + 2.5 * random.uniform()));
  }
  /// times: what the shutter really was open, as a share of the stated exposure. light: of a pixel.
  void expose(Nanoseconds stated, double times = 1, const std::function<double(std::size_t)>& light = {}) {
    exposures.push_back(stated);
    codes.emplace_back();
    for (std::size_t i = 0; i < scene.size(); ++i) {
      const double seen = (light ? light(i) : scene[i]) * seconds(stated) * times / kFull;
      const double ideal = 255 * std::pow(seen, 1 / kGamma);  // the noise comes before the clipping
      codes.back().push_back(static_cast<std::uint16_t>(
          std::clamp(std::round(ideal + sigma(ideal) * random.normal()), 0.0, 255.0)));
    }
  }
  Result<ResponseMerge> merged() const {
    std::vector<Frame> frames;
    for (std::size_t k = 0; k < codes.size(); ++k) frames.push_back({codes[k], exposures[k]});
    return merge_by_response(frames, kGrid, 1, true_curve(), {.low = 8, .high = 250});
  }
};

Camera good_camera() {
  Camera camera;
  for (const Nanoseconds t : {10ms, 20ms, 40ms, 80ms, 160ms}) camera.expose(t);
  return camera;
}

TEST(ResponseMerge, is_as_far_from_the_truth_as_its_variance_says) {
  const Camera camera = good_camera();
  const auto merged = camera.merged();
  ASSERT_TRUE(merged.ok()) << merged.error().line();
  double sum = 0, squares = 0, n = 0;
  for (std::size_t i = 0; i < camera.scene.size(); ++i) {
    if (merged->radiance.valid.values()[i] == 0) continue;
    // Where no exposure is near an end of the codes: an end selects samples by their noise.
    bool inside = true;
    for (const Nanoseconds t : camera.exposures) {
      const double code = 255 * std::pow(camera.scene[i] * seconds(t) / kFull, 1 / kGamma);
      inside = inside && (code < 4 || (code > 14 && code < 240) || code > 262);
    }
    if (!inside) continue;
    const double z = (static_cast<double>(merged->radiance.mean.values()[i]) - camera.scene[i] / kFull) /
                     std::sqrt(static_cast<double>(merged->radiance.variance.values()[i]));
    sum += z;
    squares += z * z;
    ++n;
  }
  ASSERT_GT(n, 5000);
  // V is known to 10 %, and the square of a normal quantity scatters by √2.
  EXPECT_NEAR(squares / n, 1, 0.1 + 5 * std::sqrt(2 / n));
  // The curve bends over one σ of a code: E[L(c)] − L = L'' σ² / 2, below 0.1 σ from code 14 on.
  EXPECT_LT(std::abs(sum / n), 0.1 + 5 / std::sqrt(n));
}

TEST(ResponseMerge, knows_the_noise_of_codes_even_if_something_moves) {
  for (const bool moves : {false, true}) {
    Camera camera;
    for (const Nanoseconds t : {10ms, 20ms, 40ms, 80ms})
      camera.expose(t, 1, [&](std::size_t i) {
        const bool elsewhere = moves && t == 40ms && i % 20 == 0;  // 5 % of the pixels, in one photograph
        return elsewhere ? camera.scene[(i + 77) % camera.scene.size()] : camera.scene[i];
      });
    const auto merged = camera.merged();
    ASSERT_TRUE(merged.ok());
    // 10 % of a variance; a pixel that moves in one of four frames spoils all of them, so 5 % of all
    // departures are far out, and those within four deviations add up to a tenth more.
    for (const int code : {40, 100, 160, 200})
      EXPECT_NEAR(merged->code_variance[code] / Camera::variance(code), 1, moves ? 0.3 : 0.15) << code;
  }
}

TEST(ResponseMerge, a_wrong_exposure_contradicts_its_photographs) {
  Camera camera;
  camera.expose(10ms);
  camera.expose(20ms);
  camera.expose(40ms, 1.3);  // the shutter stayed open longer than it says
  camera.expose(80ms, 1.3);
  const auto merged = camera.merged();
  ASSERT_TRUE(merged.ok());
  ASSERT_EQ(merged->ratios.size(), 3U);
  EXPECT_FALSE(merged->ratios[0].wrong());
  EXPECT_TRUE(merged->ratios[1].wrong());
  EXPECT_NEAR(merged->ratios[1].seen, 2.6, 5 * merged->ratios[1].sigma * 2.6 + 0.03);
  EXPECT_FALSE(merged->ratios[2].wrong());
}

TEST(ResponseMerge, exposures_that_are_right_contradict_nothing) {
  const auto merged = good_camera().merged();
  ASSERT_TRUE(merged.ok());
  EXPECT_EQ(merged->ratios.size(), 4U);
  for (const ExposureRatio& ratio : merged->ratios) EXPECT_FALSE(ratio.wrong()) << ratio.to_string();
}

TEST(ResponseMerge, a_pixel_that_no_frame_sees_is_not_valid) {
  Camera camera;
  camera.scene[5] = 1e3;   // white in every frame
  camera.scene[6] = 1e-9;  // black in every frame
  for (const Nanoseconds t : {10ms, 20ms, 40ms}) camera.expose(t);
  const auto merged = camera.merged();
  ASSERT_TRUE(merged.ok());
  for (const std::size_t i : {5U, 6U}) {
    EXPECT_EQ(merged->radiance.valid.values()[i], 0);
    EXPECT_EQ(merged->radiance.mean.values()[i], 0);
    EXPECT_EQ(merged->radiance.variance.values()[i], 0);
  }
}

TEST(ResponseMerge, refuses_what_it_cannot_merge) {
  Camera camera;
  camera.expose(10ms);
  EXPECT_EQ(camera.merged().error().code, ErrorCode::bad_argument);  // one frame
  camera.expose(10ms);
  EXPECT_EQ(camera.merged().error().code, ErrorCode::bad_argument);  // one exposure
  camera.expose(20ms);
  camera.codes[2].pop_back();
  EXPECT_EQ(camera.merged().error().code, ErrorCode::size_mismatch);
  camera.codes[2].push_back(256);
  EXPECT_EQ(camera.merged().error().code, ErrorCode::bad_value);
  camera.codes[2].back() = 0;
  camera.exposures[1] = 0ms;
  EXPECT_EQ(camera.merged().error().code, ErrorCode::bad_argument);
  Camera black;
  for (const Nanoseconds t : {10ms, 20ms}) black.expose(t, 1, [](std::size_t) { return 0.0; });
  EXPECT_EQ(black.merged().error().code, ErrorCode::bad_value);  // nothing to learn the noise from
}

}  // namespace

}  // namespace symrig::response_merge_test

namespace symrig::projector_response_test {
namespace {

std::vector<FieldLight> projector_levels(double gamma, double black, double sigma, int step) {
  test::Random random(2);
  std::vector<FieldLight> levels;
  for (int level = 0; level <= 255; level += step) {
    const double light = black + (1 - black) * std::pow(level / 255.0, gamma);
    levels.push_back({level, light + sigma * random.normal(), sigma * sigma});
  }
  return levels;
}

TEST(ProjectorResponse, IsMeasuredAndInverted) {
  const double sigma = 1e-4;
  const auto response = ProjectorResponse::fit(projector_levels(2.2, 0.002, sigma, 1));
  ASSERT_TRUE(response.ok()) << response.error().line();
  EXPECT_EQ(response->light(0), 0);  // black is taken off
  const auto table = CodeTable::from_light(response->curve().light);
  ASSERT_TRUE(table.ok()) << table.error().line();
  for (const float share : {0.0F, 0.1F, 0.25F, 0.5F, 0.75F, 1.0F}) {
    const double given = std::pow(table->code(share) / 255.0, 2.2);
    EXPECT_NEAR(given, share, response->resolution() + 10 * sigma) << share;
  }
  EXPECT_LT(response->resolution(), 0.0045);  // half of 2.2 / 255
}

// Straight lines between levels 15 apart miss a curve by at most h² / 8 · max|f''| = (15/255)² / 8 · 2.64.
TEST(ProjectorResponse, FewLevelsAreEnoughForASmoothOne) {
  const auto response = ProjectorResponse::fit(projector_levels(2.2, 0, 1e-5, 15));
  ASSERT_TRUE(response.ok()) << response.error().line();
  for (int level = 0; level <= 255; ++level)
    EXPECT_NEAR(response->light(level), std::pow(level / 255.0, 2.2), 0.00115 + 1e-4);
}

TEST(ProjectorResponse, NamesWhatIsWrong) {
  auto levels = projector_levels(2.2, 0.01, 1e-4, 15);
  levels[9].light = 0.02;
  const auto fallen = ProjectorResponse::fit(levels);
  ASSERT_FALSE(fallen.ok());
  EXPECT_EQ(fallen.error().code, ErrorCode::bad_value);
  EXPECT_NE(fallen.error().what.find("level 135"), std::string::npos) << fallen.error().what;
  for (FieldLight& level : levels) level.light = 0.5;
  EXPECT_EQ(ProjectorResponse::fit(levels).error().code, ErrorCode::bad_value);
  levels.resize(3);
  EXPECT_EQ(ProjectorResponse::fit(levels).error().code, ErrorCode::bad_argument);
}

// What is written is what a projector's code table takes, and turns shares of light into levels again.
TEST(ProjectorResponse, GoesThroughAFileToTheCodeTable) {
  const test::Scratch scratch;
  const auto response = ProjectorResponse::fit(projector_levels(2.2, 0.002, 1e-5, 15));
  ASSERT_TRUE(response.ok()) << response.error().line();
  ASSERT_TRUE(save_projector_response(scratch / "levels.toml", *response).ok());
  const auto light = load_projector_light(scratch / "levels.toml");
  ASSERT_TRUE(light.ok()) << light.error().line();
  const auto table = CodeTable::from_light(*light);
  const auto before = CodeTable::from_light(response->curve().light);
  ASSERT_TRUE(table.ok()) << table.error().line();
  ASSERT_TRUE(before.ok()) << before.error().line();
  for (const float share : {0.0F, 0.1F, 0.25F, 0.5F, 0.75F, 1.0F})
    EXPECT_EQ(table->code(share), before->code(share)) << share;
}

TEST(ProjectorResponse, ADamagedFileIsNamedWithItsLine) {
  const test::Scratch scratch;
  const auto refused = [&](const std::string& text, const std::string& says) {
    std::ofstream(scratch / "levels.toml") << text;
    const auto light = load_projector_light(scratch / "levels.toml");
    ASSERT_FALSE(light.ok()) << text;
    EXPECT_EQ(light.error().code, ErrorCode::bad_format);
    EXPECT_NE(light.error().what.find(says), std::string::npos) << light.error().line();
  };
  refused("light = 3\n", "there is no key light");
  refused("", "no table [levels]");
  refused("[levels]\nlight = [0, 0.5,\n 0.4]\n", "levels.toml:3: levels.light falls");
  refused("[levels]\nlight = [0, 1]\n", "has 2 levels, not 256");
  refused("[levels\n", "levels.toml:1");
  EXPECT_EQ(load_projector_light(scratch / "none.toml").error().code, ErrorCode::not_found);
}

}  // namespace

}  // namespace symrig::projector_response_test
