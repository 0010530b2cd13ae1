// SPDX-License-Identifier: Apache-2.0
// A camera clips at any code; a good sequence is not refused for it.
#include "calibration/sequence/sequence_check.hpp"
#include "calibration/sequence/sequence_verdicts.hpp"
#include "scratch.hpp"
#include "symrig/image/file.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::saturation_test {
namespace {

/// How a camera makes codes of light. The light of the scene's white reaches about 0.65.
struct Camera {
  double exposure = 1;  ///< factor on the light
  double clip = 1;      ///< share of the largest code
  double shot = 0.004;  ///< noise at a light of 1, before clipping
  double read = 0.001;  ///< noise after clipping
  int bits = 12;        ///< of a code
  int largest = 65535;  ///< of a file
  int shift = 0;        ///< unused bits below a code
};

CodePhotographs taken(const std::vector<Image<float>>& light, const GrayCode& code, const Camera& camera) {
  CodePhotographs all{code, {}, {}};
  std::uint64_t counter = 5ULL << 32;
  const double most = std::pow(2.0, camera.bits) - 1;
  for (const Image<float>& one : light) {
    Image<float> image(one.grid());
    for (std::size_t i = 0; i < image.values().size(); ++i) {
      const double v = camera.exposure * static_cast<double>(one.values()[i]);
      const double seen = std::min(v + camera.shot * std::sqrt(v) * test::normal(counter), camera.clip) +
                          camera.read * test::normal(counter);
      const double whole = std::floor(most * std::clamp(seen, 0.0, 1.0) + 0.5);
      image.values()[i] =
          static_cast<float>(whole * (1 << camera.shift)) / static_cast<float>(camera.largest);
    }
    all.images.push_back(std::move(image));
    all.names.push_back(fmt::format("{:02}.png", all.images.size() - 1));
  }
  return all;
}

std::vector<Image<float>> light_of(const test::SyntheticScene& scene) {
  const GrayCode code(scene.projector);
  std::vector<Image<float>> light;
  light.reserve(code.photographs());
  for (int k = 0; k < code.photographs(); ++k) light.push_back(test::photograph(scene, code.pattern(k)));
  return light;
}

/// A scene of two colours, without noise, texture or scattered light.
std::vector<Image<float>> two_values() {
  const GrayCode code({80, 100});
  std::vector<Image<float>> light;
  light.reserve(code.photographs());
  for (int k = 0; k < code.photographs(); ++k) {
    Image<float> image = code.pattern(k);
    for (int r = 0; r < 80; ++r)
      for (int c = 0; c < 100; ++c) image.at(r, c) = 0.05F + (r < 40 ? 0.6F : 0.3F) * image.at(r, c);
    light.push_back(std::move(image));
  }
  return light;
}

const std::vector<Image<float>>& usual() {
  static const std::vector<Image<float>> light = light_of({});
  return light;
}

std::string refusal(const std::vector<Image<float>>& light, const Camera& camera) {
  const auto result = calibration::check_sequence(taken(light, GrayCode({80, 100}), camera), {});
  return result.ok() ? std::string() : result.error().line();
}

TEST(LargestCode, is_named_by_its_bits) {
  using calibration::largest_code_at;
  EXPECT_EQ(largest_code_at(4095.F / 65535), "code 4095 of 65535, the largest of 12 bits");
  EXPECT_EQ(largest_code_at(65520.F / 65535), "code 65520 of 65535, the largest of 12 bits");
  EXPECT_EQ(largest_code_at(1023.F / 4095), "code 1023 of 4095, the largest of 10 bits");
  for (const float other : {1.F, 0.5F, 4094.F / 65535, 4096.F / 65535, 65000.F / 65535}) {
    EXPECT_FALSE(largest_code_at(other)) << other;
  }
  for (int code = 0; code < 255; ++code) {
    EXPECT_FALSE(largest_code_at(static_cast<float>(code) / 255)) << code;
  }
}

TEST(Saturation, is_found_at_any_code) {
  const Camera cameras[] = {
      {.exposure = 2.5},                                                      // 4095 of 65535
      {.exposure = 2.5, .shift = 4},                                          // 65520 of 65535
      {.exposure = 2.5, .bits = 10},                                          // 1023 of 65535
      {.exposure = 2.5, .bits = 10, .largest = 4095},                         // 1023 of 4095
      {.exposure = 2.5, .clip = 0.928, .read = 0},                            // 3800 of 4095, of 65535
      {.exposure = 2.5, .clip = 0.928, .read = 0, .largest = 4095},           // raw
      {.exposure = 2.5, .clip = 0.928},                                       // a full well, then read noise
      {.exposure = 2.5, .clip = 0.92, .read = 0, .bits = 8, .largest = 255},  // video range
      {.exposure = 1.6, .clip = 0.8, .shot = 0.02, .read = 0},
      {.exposure = 12, .clip = 0.8, .read = 0},  // everything
  };
  int k = 0;
  for (const Camera& camera : cameras) {
    const std::string line = refusal(usual(), camera);
    EXPECT_NE(line.find("28.png (white) is saturated in "), std::string::npos) << k << ": " << line;
    ++k;
  }
}

TEST(Saturation, is_not_said_of_good_photographs) {
  const Camera cameras[] = {{},
                            {.exposure = 0.1},
                            {.exposure = 1.3, .bits = 8, .largest = 255},
                            {.exposure = 1.3, .shot = 1e-6, .read = 0},
                            {.exposure = 1.3, .shot = 1e-6, .read = 0, .bits = 8, .largest = 255},
                            {.exposure = 0.3, .bits = 8, .largest = 255},
                            {.exposure = 1.3, .shot = 0.03, .read = 0.01},
                            {.exposure = 0.3, .shot = 1e-6, .read = 0, .bits = 6, .largest = 63}};
  int k = 0;
  for (const Camera& camera : cameras) {
    for (const auto* light : {&usual()}) {
      EXPECT_EQ(refusal(*light, camera).find("saturated"), std::string::npos) << k << refusal(*light, camera);
    }
    EXPECT_EQ(refusal(two_values(), camera).find("saturated"), std::string::npos) << k;
    ++k;
  }
}

// Light in floating point has no largest code. White is exposed for twice as long as the patterns.
TEST(Saturation, of_white_alone_is_found_in_light_too) {
  for (const float most : {1.0F, 0.9F, 10.0F}) {
    CodePhotographs photographs = taken(usual(), GrayCode({80, 100}), {.largest = 4095});
    photographs.saturation = std::numeric_limits<float>::infinity();
    for (float& v : photographs.images[photographs.code.white()].values()) v = std::min(2 * v, most);
    const auto result = calibration::check_sequence(photographs, {});
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().line().find("(white) is saturated") != std::string::npos, most < 10)
        << result.error().line();
  }
}

/// A folder of photographs of 24 × 40 cells, seen pixel by pixel with a texture.
class SaturatedFolder : public testing::Test {
 protected:
  static constexpr Grid kGrid{24, 40};

  static Image<float> light(int pattern) {
    Image<float> image = GrayCode(kGrid).pattern(pattern);
    for (int r = 0; r < kGrid.rows; ++r)
      for (int c = 0; c < kGrid.cols; ++c)
        image.at(r, c) = 0.05F + (0.2F + 0.01F * static_cast<float>((7 * r + 3 * c) % 61)) * image.at(r, c);
    return image;
  }
  void describe(const std::string& text) const {
    std::ofstream(scratch_ / "capture.toml") << "symrig = 1\nprojector = \"24x40\"\n" + text;
  }
  void write(const std::string& file, const Image<float>& image) const {
    ASSERT_TRUE(write_image(scratch_ / file, image).ok());
  }
  std::string refusal() const {
    const auto read = read_gray_code_folder(scratch_.folder());
    if (!read) return read.error().line();
    const auto result = calibration::check_sequence(*read, {});
    return result.ok() ? std::string() : result.error().line();
  }

  test::Scratch scratch_;
};

TEST_F(SaturatedFolder, stated_bits_are_used) {
  const GrayCode code(kGrid);
  for (int k = 0; k < code.photographs(); ++k) {
    Image<float> image = light(k);
    for (float& v : image.values()) v = std::min(std::round(3 * 1000 * v), 1023.F) / 65535;
    write(fmt::format("{:02}.png", k), image);
  }
  describe("[sensor]\nbits = 10\n");
  EXPECT_EQ(read_gray_code_folder(scratch_.folder())->saturation, 1023.F / 65535);
  EXPECT_NE(refusal().find("code 1023 of 65535"), std::string::npos) << refusal();
  describe("[sensor]\nbits = 9\n");
  EXPECT_NE(refusal().find("code 1023 does not fit in 9 bits"), std::string::npos) << refusal();
  describe("[sensor]\nbits = 16\n");
  EXPECT_EQ(read_gray_code_folder(scratch_.folder())->saturation, 1.F);
}

TEST_F(SaturatedFolder, one_full_channel_is_enough) {
  const GrayCode code(kGrid);
  describe("");
  for (const float exposure : {1.F, 3.F}) {
    for (int k = 0; k < code.photographs(); ++k) {
      const Image<float> grey = light(k);
      Image<float> image(kGrid, 3);
      for (int c = 0; c < 3; ++c)
        std::ranges::transform(grey.values(), image.plane(c).begin(),
                               [&](float v) { return std::min(exposure * v * (c == 2 ? 1.F : 0.3F), 1.F); });
      write(fmt::format("{:02}.png", k), image);
    }
    EXPECT_EQ(refusal().find("(white) is saturated") != std::string::npos, exposure > 1) << refusal();
  }
}

// Exposures of 10 and 40 ms of a camera that clips at 3000 codes of 65535: the long one counts below only.
TEST_F(SaturatedFolder, a_long_exposure_counts_up_to_the_code_where_it_stays) {
  const GrayCode code(kGrid);
  std::string text;
  for (int k = 0; k < code.photographs(); ++k)
    for (const int factor : {1, 4}) {
      Image<float> image = light(k);
      for (float& v : image.values())
        v = std::min(std::round(static_cast<float>(factor) * 2900 * v), 3000.F) / 65535;
      const std::string file = fmt::format("{}_{}.png", k, factor);
      write(file, image);
      const StripePair pair = k < code.white() ? code.pair(k / 2) : StripePair{};
      const std::string pattern =
          k >= code.white() ? std::string(k == code.white() ? "white" : "black")
                            : fmt::format("{} {}{}", pair.axis == StripeAxis::columns ? "columns" : "rows",
                                          pair.bit, k % 2 != 0 ? " complement" : "");
      text += fmt::format("[[photograph]]\nfile = \"{}\"\npattern = \"{}\"\nexposure = \"{} ms\"\n", file,
                          pattern, 10 * factor);
    }
  describe(text);
  const auto read = read_gray_code_folder(scratch_.folder());
  ASSERT_TRUE(read.ok()) << read.error().line();
  for (int k = 0; k < code.photographs(); ++k)
    for (std::size_t i = 0; i < read->image(k).values().size(); ++i)
      ASSERT_NEAR(read->image(k).values()[i] * 65535, light(k).values()[i] * 2900, 0.6) << k;
  const auto right = calibration::check_sequence(*read, {});
  EXPECT_TRUE(right.ok()) << right.error().line();
}

}  // namespace
}  // namespace symrig::saturation_test
