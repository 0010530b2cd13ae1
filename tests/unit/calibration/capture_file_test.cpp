// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/capture_file.hpp"

#include "scratch.hpp"
#include "symrig/image/file.hpp"
#include "synthetic_photographs.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::capture_file_test {
namespace {

namespace fs = std::filesystem;

TEST(CapturePattern, NamesAreThoseOfTheSequence) {
  const GrayCode code({24, 40});  // 6 bits of columns, 5 of rows
  EXPECT_EQ(code_pattern(code, "columns 0"), 0);
  EXPECT_EQ(code_pattern(code, "columns 5 complement"), 11);
  EXPECT_EQ(code_pattern(code, "rows 0"), 12);
  EXPECT_EQ(code_pattern(code, "rows 4 complement"), 21);
  EXPECT_EQ(code_pattern(code, "white"), 22);
  EXPECT_EQ(code_pattern(code, "black"), 23);
  for (const char* wrong : {"", "columns", "columns ", "columns 6", "rows 5", "columns -1", "columns 1x",
                            "rows 0complement", "diagonal 0", "white complement"})
    EXPECT_EQ(code_pattern(code, wrong), std::nullopt) << wrong;
}

struct Refused {
  const char* name;
  const char* text;
  const char* says;
};

class CaptureFileRefuses : public testing::TestWithParam<Refused> {};

TEST_P(CaptureFileRefuses, WithTheLine) {
  const auto file = parse_capture_file(GetParam().text, "capture.toml");
  ASSERT_FALSE(file.ok());
  const std::string line = file.error().line();
  EXPECT_EQ(file.error().code, ErrorCode::bad_format) << line;
  EXPECT_NE(line.find(GetParam().says), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos);
}
INSTANTIATE_TEST_SUITE_P(
    Text, CaptureFileRefuses,
    testing::Values(
        Refused{"no_version", "projector = \"24x40\"\n", "symrig"},
        Refused{"unknown_key", "symrig = 1\nprojektor = \"24x40\"\n", "projektor"},
        Refused{"projector", "symrig = 1\nprojector = \"24by40\"\n", "capture.toml:2: projector"},
        Refused{"sensor_key", "symrig = 1\n[sensor]\ndarks = [\"a.png\"]\n",
                "capture.toml:3: there is no key sensor.darks"},
        Refused{"no_exposure", "symrig = 1\n[[sensor.bracket]]\nfile = \"a.png\"\n",
                "sensor.bracket.exposure"},
        Refused{"no_list", "symrig = 1\n[sensor.flat]\nfiles = [\"a.png\"]\n", "is not a list of tables"},
        Refused{"format", "symrig = 1\n[raw]\nformat = \"Y99\"\nsize = \"40x24\"\n",
                "capture.toml:3: raw.format"},
        Refused{"not_linear", "symrig = 1\n[raw]\nformat = \"YUYV\"\nsize = \"40x24\"\n",
                "not proportional to light"},
        Refused{"short_stride", "symrig = 1\n[raw]\nformat = \"Y16\"\nsize = \"40x24\"\nstride = 79\n",
                "79 bytes are too few for a row of 40 samples"},
        Refused{"pattern",
                "symrig = 1\nprojector = \"24x40\"\n[[photograph]]\nfile = \"a.png\"\npattern = \"rows 5\"\n",
                "capture.toml:5: photograph.pattern: \"rows 5\" is not in the sequence"},
        Refused{"no_projector", "symrig = 1\n[[photograph]]\nfile = \"a.png\"\npattern = \"rows 0\"\n",
                "the projector's size is missing"},
        Refused{"exposure", "symrig = 1\nexposure = \"20\"\n", "capture.toml:2: exposure"}),
    [](const auto& test) { return test.param.name; });

/// A flat scene that the camera sees pixel by pixel: light 0.1 + 0.5 · pattern at an exposure of 10 ms.
class CaptureFolder : public testing::Test {
 protected:
  static constexpr Grid kGrid{24, 40};

  static Image<float> light(int pattern) {
    Image<float> image = GrayCode(kGrid).pattern(pattern);
    for (float& v : image.values()) v = 0.1F + 0.5F * v;
    return image;
  }
  void write(const std::string& file, const std::string& text) const {
    std::ofstream(folder_ / file) << text;
  }
  /// "[[photograph]]" of the capture file.
  static std::string entry(const std::string& file, int pattern, const std::string& more = "") {
    const GrayCode code(kGrid);
    std::string what = pattern == code.white() ? "white" : "black";
    if (pattern < code.white()) {
      const StripePair pair = code.pair(pattern / 2);
      what = fmt::format("{} {}{}", pair.axis == StripeAxis::columns ? "columns" : "rows", pair.bit,
                         pattern % 2 ? " complement" : "");
    }
    return fmt::format("[[photograph]]\nfile = \"{}\"\npattern = \"{}\"\n{}\n", file, what, more);
  }
  /// Samples of 10 bits in the low bits of words, 6 bytes of padding a row.
  void write_raw(const std::string& file, const Image<float>& image) const {
    std::string bytes;
    for (int r = 0; r < image.grid().rows; ++r) {
      for (int c = 0; c < image.grid().cols; ++c) {
        const auto code = static_cast<unsigned>(std::lround(image.at(r, c) * 1023));
        bytes += static_cast<char>(code & 0xFFU);
        bytes += static_cast<char>(code >> 8U);
      }
      bytes += std::string(6, '\x7f');
    }
    write(file, bytes);
  }

  test::Scratch scratch_;
  const fs::path& folder_ = scratch_.folder();
};

TEST_F(CaptureFolder, MayLackComplementsOrAnAxis) {
  const GrayCode code(kGrid);
  const auto read_those = [&](auto keep) {
    std::string text = "symrig = 1\nprojector = \"24x40\"\n";
    for (int k = 0; k < code.photographs(); ++k) {
      if (k < code.white() && !keep(k)) continue;
      const std::string file = fmt::format("p{}.exr", k);
      EXPECT_TRUE(write_image(folder_ / file, light(k)).ok());
      text += entry(file, k);
    }
    write("capture.toml", text);
    return read_gray_code_folder(folder_);
  };
  const auto patterns = read_those([](int k) { return k % 2 == 0; });
  ASSERT_TRUE(patterns.ok()) << patterns.error().line();
  EXPECT_TRUE(patterns->complements_derived);
  EXPECT_EQ(patterns->code.axes(), CodeAxes::both);
  ASSERT_EQ(patterns->images.size(), static_cast<std::size_t>(code.photographs()));
  EXPECT_EQ(patterns->names[5], "p4.exr inverted");
  for (int k = 0; k < code.photographs(); ++k)
    for (std::size_t i = 0; i < kGrid.size(); ++i)
      ASSERT_NEAR(patterns->image(k).values()[i], light(k).values()[i], 1e-6F);

  const auto rows = read_those([&](int k) { return k / 2 >= code.column_bits(); });
  ASSERT_TRUE(rows.ok()) << rows.error().line();
  EXPECT_FALSE(rows->complements_derived);
  EXPECT_EQ(rows->code.axes(), CodeAxes::rows);
  EXPECT_EQ(rows->image(0), light(2 * code.column_bits()));

  // One missing complement among others is a missing photograph.
  const auto refused = read_those([](int k) { return k != 7; });
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().line().find("no photograph of \"columns 3 complement\""), std::string::npos)
      << refused.error().line();
}

TEST_F(CaptureFolder, PatternsAreFoundByNameInAnyOrder) {
  const GrayCode code(kGrid);
  std::string text = "symrig = 1\nprojector = \"24x40\"\n";
  for (int k = code.photographs() - 1; k >= 0; --k) {
    const std::string file = fmt::format("p{}.exr", (7 * k) % 24);
    ASSERT_TRUE(write_image(folder_ / file, light(k)).ok());
    text += entry(file, k);
  }
  write("capture.toml", text);
  const auto read = read_gray_code_folder(folder_);
  ASSERT_TRUE(read.ok()) << read.error().line();
  for (int k = 0; k < code.photographs(); ++k) EXPECT_EQ(read->image(k), light(k)) << k;
  EXPECT_EQ(read->names[3], "p21.exr");
}

// 16-bit PNG of 10 and 40 ms: what the long exposure saturates comes from the short one alone, the rest is
// the mean of both by exposure; pedestal 0.05. Rounding: half a code of 65535 in each.
TEST_F(CaptureFolder, ExposuresOfOnePatternBecomeOne) {
  const GrayCode code(kGrid);
  std::string text = "symrig = 1\nprojector = \"24x40\"\npedestal = 0.05\n";
  for (int k = 0; k < code.photographs(); ++k)
    for (const int factor : {1, 4}) {
      Image<float> image = light(k);
      for (float& v : image.values()) v = 0.05F + static_cast<float>(factor) * v;
      const std::string file = fmt::format("{}_{}.png", k, factor);
      ASSERT_TRUE(write_image(folder_ / file, image).ok());
      text += entry(file, k, fmt::format("exposure = \"{} ms\"", 10 * factor));
    }
  write("capture.toml", text);
  const auto read = read_gray_code_folder(folder_);
  ASSERT_TRUE(read.ok()) << read.error().line();
  for (int k = 0; k < code.photographs(); ++k)
    for (std::size_t i = 0; i < read->image(k).values().size(); ++i)
      ASSERT_NEAR(read->image(k).values()[i], light(k).values()[i], 1.0 / 65535) << k;
}

// Light has no largest code, so 1.5 is as good as 0.1. The suffix may have large letters.
TEST_F(CaptureFolder, LightAboveOneIsNotSaturated) {
  const GrayCode code(kGrid);
  for (const char* suffix : {"exr", "EXR", "PFM"}) {
    std::string text = "symrig = 1\nprojector = \"24x40\"\n";
    for (int k = 0; k < code.photographs(); ++k) {
      Image<float> image = light(k);
      for (float& v : image.values()) v *= 4;
      const std::string file = fmt::format("{}.{}", k, suffix);
      ASSERT_TRUE(write_image(folder_ / file, image).ok());
      text += entry(file, k, "exposure = \"10 ms\"");
    }
    write("capture.toml", text);
    const auto read = read_gray_code_folder(folder_);
    ASSERT_TRUE(read.ok()) << read.error().line();
    for (std::size_t i = 0; i < read->white().values().size(); ++i)
      ASSERT_FLOAT_EQ(read->white().values()[i], 4 * light(code.white()).values()[i]) << suffix;
  }
}

TEST_F(CaptureFolder, ExposuresAreToldForAllOrNone) {
  write("capture.toml", "symrig = 1\nprojector = \"24x40\"\n" + entry("a.png", 0, "exposure = \"10 ms\"") +
                            entry("b.png", 1));
  const auto read = read_gray_code_folder(folder_);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().line().find("b.png has no exposure"), std::string::npos) << read.error().line();
}

TEST_F(CaptureFolder, RawDumpsAreReadByTheirLayout) {
  const GrayCode code(kGrid);
  for (int k = 0; k < code.photographs(); ++k) write_raw(fmt::format("{}.raw", k), light(k));
  write("capture.toml",
        "symrig = 1\nprojector = \"24x40\"\n[raw]\nformat = \"Y10\"\nsize = \"40x24\"\nstride = 86\n");
  const auto read = read_gray_code_folder(folder_);
  ASSERT_TRUE(read.ok()) << read.error().line();
  for (int k = 0; k < code.photographs(); ++k)
    for (std::size_t i = 0; i < read->image(k).values().size(); ++i)
      ASSERT_NEAR(read->image(k).values()[i], light(k).values()[i], 0.5 / 1023 + 1e-6) << k;
}

TEST_F(CaptureFolder, ARawDumpOfAnotherSizeIsNamed) {
  const GrayCode code(kGrid);
  for (int k = 0; k < code.photographs(); ++k) write_raw(fmt::format("{:02}.raw", k), light(k));
  fs::resize_file(folder_ / "05.raw", 1000);
  write("capture.toml",
        "symrig = 1\nprojector = \"24x40\"\n[raw]\nformat = \"Y10\"\nsize = \"40x24\"\nstride = 86\n");
  const auto read = read_gray_code_folder(folder_);
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::bad_format);
  EXPECT_NE(read.error().line().find("05.raw: has 1000 bytes; 24 rows of 86 bytes are 2064"),
            std::string::npos)
      << read.error().line();
}

TEST_F(CaptureFolder, AMissingPatternIsNamed) {
  const GrayCode code(kGrid);
  std::string text = "symrig = 1\nprojector = \"24x40\"\n";
  for (int k = 0; k < code.photographs(); ++k) {
    if (k == 15) continue;
    ASSERT_TRUE(write_image(folder_ / fmt::format("{}.exr", k), light(k)).ok());
    text += entry(fmt::format("{}.exr", k), k);
  }
  write("capture.toml", text);
  const auto read = read_gray_code_folder(folder_);
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::bad_value);
  EXPECT_NE(read.error().line().find("no photograph of \"rows 1 complement\""), std::string::npos)
      << read.error().line();
}

}  // namespace
}  // namespace symrig::capture_file_test
