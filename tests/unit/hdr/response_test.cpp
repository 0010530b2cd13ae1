// SPDX-License-Identifier: Apache-2.0
// Response curves of cameras and projectors: recovered within bounds, and never broken.
#include "symrig/hdr/response.hpp"

#include "simulated_sensor.hpp"
#include "symrig/hdr/projector_response.hpp"

#include <functional>

#include <gtest/gtest.h>

namespace symrig {
namespace {

using namespace std::chrono_literals;

/// An 8-bit camera whose code is 255 (light)^(1/γ) plus noise, of a scene over four decades.
struct Curved {
  double gamma;
  double noise = 0.7;  // codes
  std::vector<std::vector<std::uint16_t>> codes{};
  std::vector<Nanoseconds> exposures{};

  void expose(std::initializer_list<Nanoseconds> times, std::size_t pixels = 20'000) {
    test::Random random(9);
    std::vector<double> scene;
    for (std::size_t i = 0; i < pixels; ++i) scene.push_back(std::pow(10, -3 + 4 * random.uniform()));
    for (const Nanoseconds t : times) {
      exposures.push_back(t);
      codes.emplace_back();
      for (const double light : scene) {
        const double ideal = 255 * std::pow(std::min(1.0, light * seconds(t) / 0.1), 1 / gamma);
        codes.back().push_back(
            static_cast<std::uint16_t>(std::clamp(std::round(ideal + noise * random.normal()), 0.0, 255.0)));
      }
    }
  }
  std::vector<Frame> frames() const {
    std::vector<Frame> all;
    for (std::size_t k = 0; k < codes.size(); ++k) all.push_back({codes[k], exposures[k]});
    return all;
  }
};

void expect_sound(const ResponseCurve& curve, std::size_t codes) {
  ASSERT_EQ(curve.light.size(), codes);
  EXPECT_EQ(curve.light.front(), 0);
  EXPECT_EQ(curve.light.back(), 1);
  for (std::size_t c = 0; c < codes; ++c) {
    ASSERT_TRUE(std::isfinite(curve.light[c])) << c;
    if (c > 0) {
      ASSERT_GT(curve.light[c], curve.light[c - 1]) << c;
    }
  }
}

/// Largest relative error of the curve's shape against light = (code / 255)^γ in the middle four fifths; the
/// scale, which no response recovery can know, is taken out at code 128.
double shape_error(const ResponseCurve& curve, double gamma) {
  double worst = 0;
  for (int c = 40; c <= 225; ++c) {
    const double truth = std::pow(c / 128.0, gamma);
    worst = std::max(worst, std::abs(curve(c) / curve(128) / truth - 1));
  }
  return worst;
}

using Recover = Result<ResponseCurve> (*)(std::span<const Frame>, const ResponseOptions&);
class Recovery : public testing::TestWithParam<std::tuple<Recover, double>> {};

// Noise of 0.7 codes is 1.75 % γ at code 40; hundreds of samples a code leave a tenth of it, and smoothing
// and the lower end's selection add the rest. Robertson's has no smoothing.
TEST_P(Recovery, FindsTheShapeWithinAFewPercent) {
  const auto [recover, gamma] = GetParam();
  Curved camera{gamma};
  camera.expose({5ms, 10ms, 20ms, 40ms, 80ms, 160ms});
  const auto curve = recover(camera.frames(), {.low = 5, .high = 250});
  ASSERT_TRUE(curve.ok()) << curve.error().line();
  expect_sound(*curve, 256);
  EXPECT_LE(shape_error(*curve, gamma), recover == &recover_debevec ? 0.05 : 0.06);
}

// Cases that make published implementations return NaN or curves that fall: few pixels, pure noise, light
// that changed between frames, half of the codes never reached.
TEST_P(Recovery, IsMonotoneAndFiniteWhateverTheFrames) {
  const auto [recover, gamma] = GetParam();
  for (const double noise : {0.0, 5.0, 60.0}) {
    Curved camera{gamma, noise};
    camera.expose({10ms, 30ms, 80ms}, 3000);
    auto frames = camera.frames();
    const auto curve = recover(frames, {});
    ASSERT_TRUE(curve.ok()) << curve.error().line();
    expect_sound(*curve, 256);
    frames[0].exposure = 500ms;  // wrong labels
    const auto wrong = recover(frames, {});
    ASSERT_TRUE(wrong.ok()) << wrong.error().line();
    expect_sound(*wrong, 256);
    const auto narrow = recover(camera.frames(), {.low = 20, .high = 120});
    ASSERT_TRUE(narrow.ok()) << narrow.error().line();
    expect_sound(*narrow, 256);
  }
}

TEST_P(Recovery, TellsFramesThatCannotTell) {
  const auto [recover, gamma] = GetParam();
  Curved camera{gamma};
  camera.expose({10ms, 10ms});
  EXPECT_EQ(recover(camera.frames(), {}).error().code, ErrorCode::bad_argument);
  const std::vector<std::uint16_t> white(500, 255), black(500, 0);
  const std::vector<Frame> clipped{{white, 10ms}, {black, 1ms}};
  EXPECT_EQ(recover(clipped, {}).error().code, ErrorCode::bad_value);
  const std::vector<Frame> one{{white, 10ms}};
  EXPECT_EQ(recover(one, {}).error().code, ErrorCode::bad_argument);
}
INSTANTIATE_TEST_SUITE_P(Methods, Recovery,
                         testing::Combine(testing::Values(&recover_debevec, &recover_robertson),
                                          testing::Values(1.0, 1.8, 2.2)));

TEST(ResponseCurve, TwelveBitCodesAreRecoveredToo) {
  Curved camera{1.8};
  camera.expose({5ms, 10ms, 20ms, 40ms, 80ms, 160ms});
  for (auto& frame : camera.codes)
    for (auto& code : frame) code = static_cast<std::uint16_t>(16 * code);
  const auto curve = recover_debevec(camera.frames(), {.bits = 12, .low = 80, .high = 4000});
  ASSERT_TRUE(curve.ok()) << curve.error().line();
  expect_sound(*curve, 4096);
  EXPECT_NEAR((*curve)(16 * 200) / (*curve)(16 * 100), std::pow(2, 1.8), 0.05 * std::pow(2, 1.8));
}

TEST(ResponseCurve, InverseUndoesIt) {
  ResponseCurve curve;
  for (int c = 0; c < 256; ++c) curve.light.push_back(std::pow(c / 255.0, 2.2));
  for (const double code : {0.0, 1.0, 17.5, 128.0, 254.9, 255.0})
    EXPECT_NEAR(curve.code_of(curve(code)), code, 1e-6);
}

TEST(Linearity, TellsALinearCameraFromACurvedOne) {
  const NoiseModel sensor = NoiseModel::from_electrons({});
  for (const double bend : {0.0, 0.05}) {  // light lost at full scale
    test::Random random(4);
    std::vector<std::vector<std::uint16_t>> codes;
    std::vector<Frame> frames;
    for (const Nanoseconds t : {10ms, 20ms, 40ms}) {
      test::Random scene(8);
      codes.emplace_back();
      for (int i = 0; i < 40'000; ++i) {
        const double electrons = 18'000 * scene.uniform() * seconds(t) / 0.04;
        codes.back().push_back(test::sample(sensor, electrons * (1 - bend * electrons / 20'000), random));
      }
    }
    for (std::size_t k = 0; k < 3; ++k) frames.push_back({codes[k], std::array{10ms, 20ms, 40ms}[k]});
    const auto linearity = test_linearity(frames, sensor);
    ASSERT_TRUE(linearity.ok()) << linearity.error().line();
    EXPECT_EQ(linearity->linear(), bend == 0) << linearity->worst << " ± " << linearity->worst_sigma;
    if (bend == 0) {
      EXPECT_LE(linearity->worst, 6 * linearity->worst_sigma);  // the worst of sixteen bins
    }
  }
}

TEST(Isotonic, PoolsWhatFalls) {
  const std::vector<double> values{1, 3, 2, 2, 5, 4}, weights{1, 1, 1, 2, 1, 1};
  const std::vector<double> fit = isotonic(values, weights);
  const std::vector<double> expected{1, 2.25, 2.25, 2.25, 4.5, 4.5};
  for (std::size_t k = 0; k < fit.size(); ++k) EXPECT_NEAR(fit[k], expected[k], 1e-12);
}

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
  EXPECT_NEAR(response->black(), 0.002, 5 * sigma);
  for (const double share : {0.0, 0.1, 0.25, 0.5, 0.75, 1.0}) {
    const double given = std::pow(response->level_for(share) / 255.0, 2.2);
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

}  // namespace
}  // namespace symrig
