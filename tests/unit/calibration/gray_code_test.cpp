// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/gray_code.hpp"

#include "scratch.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/image/file.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

namespace symrig::gray_code_test {
namespace {

namespace fs = std::filesystem;

/// A folder that goes with the test.
class GrayCodeFolder : public testing::Test {
 protected:
  /// Writes a sequence as 0.png, 1.png, ..., 27.png: natural order matters.
  void write(const CodePhotographs& photographs) const {
    for (std::size_t i = 0; i < photographs.images.size(); ++i)
      ASSERT_TRUE(write_image(path(i), photographs.images[i]).ok());
  }
  fs::path path(std::size_t i) const { return folder_ / (std::to_string(i) + ".png"); }

  test::Scratch scratch_;
  const fs::path& folder_ = scratch_.folder();
};

std::string lit_positions(const GrayCode& code, int photograph) {
  const Pattern pattern = code.pattern(photograph);
  std::string text;
  for (int row = 0; row < pattern.grid().rows; ++row, text += '/')
    for (int col = 0; col < pattern.grid().cols; ++col) text += pattern.at(row, col) > 0 ? '#' : '.';
  return text;
}

TEST(GrayCode, PatternsAreTheHandWrittenOnes) {
  const GrayCode code({4, 8});
  ASSERT_EQ(code.photographs(), 12);
  EXPECT_EQ(lit_positions(code, 0), "....####/....####/....####/....####/");
  EXPECT_EQ(lit_positions(code, 1), "####..../####..../####..../####..../");
  EXPECT_EQ(lit_positions(code, 2), "..####../..####../..####../..####../");
  EXPECT_EQ(lit_positions(code, 4), ".##..##./.##..##./.##..##./.##..##./");
  EXPECT_EQ(lit_positions(code, 6), "......../......../########/########/");
  EXPECT_EQ(lit_positions(code, 8), "......../########/########/......../");
  EXPECT_EQ(lit_positions(code, 10), "########/########/########/########/");
  EXPECT_EQ(lit_positions(code, 11), "......../......../......../......../");
}

TEST(GrayCode, PairsKnowTheirStripes) {
  const GrayCode code({768, 1024});
  EXPECT_EQ(code.photographs(), 42);
  const int widths[] = {512, 512, 256, 128, 64, 32, 16, 8, 4, 2};
  for (int k = 0; k < 10; ++k) {
    EXPECT_EQ(code.pair(k).stripe_width, widths[k]);
    EXPECT_EQ(code.pair(10 + k).stripe_width, widths[k]);
    EXPECT_EQ(code.pair(10 + k).axis, StripeAxis::rows);
  }
  EXPECT_EQ(code.pair(4).name, "columns, 64 px");
}

TEST(GrayCode, NumberOfPhotographsTellsTheProjector) {
  EXPECT_EQ(GrayCode::of_length(42)->projector(), (Grid{768, 1024}));
  EXPECT_EQ(GrayCode::of_length(46)->projector(), (Grid{1080, 1920}));
  EXPECT_EQ(GrayCode::of_length(28)->projector(), (Grid{64, 128}));
  EXPECT_FALSE(GrayCode::of_length(41));
  EXPECT_FALSE(GrayCode::of_length(2));
}

TEST_F(GrayCodeFolder, IsReadInNaturalOrder) {
  const auto& photographs = test::default_photographs();
  write(photographs);
  std::ofstream(folder_ / "README.txt") << "not a picture";
  const auto read = read_gray_code_folder(folder_, {.projector = Grid{80, 100}});
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->names[2], "2.png");
  EXPECT_EQ(read->names[10], "10.png");
  // 8-bit codes survive the 16-bit file: v = k / 255 is stored as 257 k.
  for (std::size_t i = 0; i < photographs.images.size(); ++i)
    EXPECT_EQ(read->images[i], photographs.images[i]) << i;
}

// What macOS keeps beside each file on drives that have no attributes, and a file that is still being
// written.
TEST_F(GrayCodeFolder, HiddenFilesAreNoPhotographs) {
  const auto& photographs = test::default_photographs();
  write(photographs);
  const auto beside = [&](const fs::path& path, const std::string& head) {
    return folder_ / (head + path.filename().string());
  };
  for (std::size_t i = 0; i < photographs.images.size(); ++i)
    std::ofstream(beside(path(i), "._")) << std::string("\0\5\x16\7\0\2\0\0Mac OS X", 16);
  fs::copy_file(path(0), beside(path(0), "."));
  std::ofstream(folder_ / "._0.raw") << "no picture";
  const auto read = read_gray_code_folder(folder_, {.projector = Grid{80, 100}});
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->names.size(), photographs.images.size());
  EXPECT_EQ(read->names[2], "2.png");
  const auto named = read_image(folder_ / "._2.png");
  ASSERT_FALSE(named.ok());
  EXPECT_NE(named.error().what.find("AppleDouble"), std::string::npos) << named.error().line();
}

struct Spoiled {
  const char* name;
  ErrorCode code;
  const char* says;  // part of the message
  void (*spoil)(const fs::path& folder);
};

class GrayCodeFolderRefuses : public GrayCodeFolder, public testing::WithParamInterface<Spoiled> {};

TEST_P(GrayCodeFolderRefuses, InOneClearLine) {
  write(test::default_photographs());
  GetParam().spoil(folder_);
  const auto map = decode_gray_code(folder_, {.projector = Grid{80, 100}});
  ASSERT_FALSE(map.ok());
  EXPECT_EQ(map.error().code, GetParam().code) << map.error().line();
  EXPECT_NE(map.error().line().find(GetParam().says), std::string::npos) << map.error().line();
  EXPECT_EQ(map.error().line().find('\n'), std::string::npos);
}

const Image<float> kSmall(Grid{3, 3}, 1, 0.5F);

INSTANTIATE_TEST_SUITE_P(
    Folder, GrayCodeFolderRefuses,
    testing::Values(
        Spoiled{"no_folder", ErrorCode::not_found, "no such folder",
                [](const fs::path& f) { fs::remove_all(f); }},
        Spoiled{"empty", ErrorCode::not_found, "contains no",
                [](const fs::path& f) { fs::remove_all(f), fs::create_directories(f); }},
        Spoiled{"one_missing", ErrorCode::size_mismatch,
                "has 29 photographs (between 6.png and 8.png there is a gap)",
                [](const fs::path& f) { fs::remove(f / "7.png"); }},
        Spoiled{"one_too_many", ErrorCode::size_mismatch, "has 31 photographs",
                [](const fs::path& f) { fs::copy_file(f / "7.png", f / "7b.png"); }},
        Spoiled{"mixed_sizes", ErrorCode::size_mismatch, "5.png is 3x3",
                [](const fs::path& f) { ASSERT_TRUE(write_image(f / "5.png", kSmall).ok()); }},
        Spoiled{"truncated", ErrorCode::bad_format, "9.png",
                [](const fs::path& f) { fs::resize_file(f / "9.png", fs::file_size(f / "9.png") / 2); }},
        Spoiled{"white_is_black", ErrorCode::bad_value, "not brighter than black",
                [](const fs::path& f) {
                  fs::rename(f / "28.png", f / "x"), fs::rename(f / "29.png", f / "28.png"),
                      fs::rename(f / "x", f / "29.png");
                }},
        Spoiled{"pair_swapped", ErrorCode::bad_value, "4.png and 5.png (columns, 32 px) are swapped",
                [](const fs::path& f) {
                  fs::rename(f / "4.png", f / "x"), fs::rename(f / "5.png", f / "4.png"),
                      fs::rename(f / "x", f / "5.png");
                }},
        Spoiled{"black_is_white", ErrorCode::bad_value, "not brighter than black",
                [](const fs::path& f) {
                  fs::copy_file(f / "28.png", f / "29.png", fs::copy_options::overwrite_existing);
                }}),
    [](const auto& test) { return test.param.name; });

TEST_F(GrayCodeFolder, ReadingCanBeStopped) {
  write(test::default_photographs());
  const auto read = read_gray_code_folder(
      folder_, {.projector = Grid{80, 100}, .progress = [](const ProgressEvent& e) { return e.done < 3; }});
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::interrupted);
}

}  // namespace
}  // namespace symrig::gray_code_test
