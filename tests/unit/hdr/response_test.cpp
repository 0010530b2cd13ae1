// SPDX-License-Identifier: Apache-2.0
// Response curves of cameras and projectors: recovered within bounds, and never broken.
#include "symrig/hdr/response.hpp"

#include "simulated_sensor.hpp"

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::response_test {
namespace {

using namespace std::chrono_literals;

/// An 8-bit camera whose code is 255 (light)^(1/γ) plus noise, of a scene over four decades.
struct Curved {
  double gamma;
  double noise = 0.7;  // codes
  double largest = 255;
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
        const double ideal = largest * std::pow(std::min(1.0, light * seconds(t) / 0.1), 1 / gamma);
        codes.back().push_back(static_cast<std::uint16_t>(
            std::clamp(std::round(ideal + noise * random.normal()), 0.0, largest)));
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

// Light is known to a code where noise of 0.7 codes is far from the pedestal.
TEST(ResponseCurve, OfALinearCameraIsItsStraightLine) {
  for (const int pedestal : {0, 40}) {
    Curved camera{1.0};
    camera.largest = 4095 - pedestal;
    camera.expose({5ms, 10ms, 20ms, 40ms, 80ms, 160ms});
    for (auto& frame : camera.codes)
      for (auto& code : frame) code = static_cast<std::uint16_t>(code + pedestal);
    const auto found = recover_response(camera.frames(), {.bits = 12, .high = 4080});
    ASSERT_TRUE(found.ok()) << found.error().line();
    expect_sound(found->curve, 4096);
    ASSERT_TRUE(found->straight) << pedestal;
    EXPECT_NEAR(found->straight->pedestal(), pedestal, 0.5) << pedestal;
    for (const int code : {4, 16, 64, 1000, 4000})
      EXPECT_NEAR(found->curve.light[code + pedestal] * (4095.0 - pedestal), code, 1) << pedestal;
  }
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

TEST(ResponseFile, IsReadAsItWasWritten) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "response.toml";
  ResponseCurve curve;
  curve.samples = 17;
  for (int code = 0; code < 256; ++code) curve.light.push_back(std::pow(code / 255.0, 2.2));
  ASSERT_TRUE(save_response(path, curve).ok());
  const auto read = load_response(path);
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->light, curve.light);
  EXPECT_EQ(read->samples, 17);
}

TEST(ResponseFile, NamesWhatIsWrong) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "bad_response.toml";
  for (const auto& [text, says] : std::vector<std::pair<std::string, std::string>>{
           {"[response]\nlight = [0, 0.5, 0.4, 1]\n",
            ":2: response.light does not rise from 0 to 1 at code 2"},
           {"[response]\nlight = [0, 0.5, 1]\n", "3 codes"},
           {"[response]\nlight = [0, 0.5]\n", "does not end at 1"},
           {"[response]\nlight = [0, nan]\n", "at code 1"},
           {"[response]\n", "no table [response] with light"},
           {"[response\n", ":"}}) {
    std::ofstream(path) << text;
    const auto read = load_response(path);
    ASSERT_FALSE(read.ok()) << text;
    EXPECT_EQ(read.error().code, ErrorCode::bad_format);
    EXPECT_NE(read.error().what.find(says), std::string::npos) << read.error().line();
  }
}

TEST(Isotonic, PoolsWhatFalls) {
  const std::vector<double> values{1, 3, 2, 2, 5, 4}, weights{1, 1, 1, 2, 1, 1};
  const std::vector<double> fit = isotonic(values, weights);
  const std::vector<double> expected{1, 2.25, 2.25, 2.25, 4.5, 4.5};
  for (std::size_t k = 0; k < fit.size(); ++k) EXPECT_NEAR(fit[k], expected[k], 1e-12);
}

}  // namespace
}  // namespace symrig::response_test
