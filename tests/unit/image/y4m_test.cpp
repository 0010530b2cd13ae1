// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/y4m.hpp"

#include "scratch.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

namespace symrig::y4m_test {
namespace {

namespace fs = std::filesystem;

/// A folder that goes with the test.
class Y4m : public testing::Test {
 protected:
  fs::path film(const std::string& bytes, const std::string& name = "film.y4m") const {
    std::ofstream(scratch_ / name, std::ios::binary) << bytes;
    return scratch_ / name;
  }
  static std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(scratch_.folder()), {}));
  }

  test::Scratch scratch_;
};

std::string header(const std::string& colours, int cols = 3, int rows = 2) {
  return "YUV4MPEG2 W" + std::to_string(cols) + " H" + std::to_string(rows) + " F30000:1001 Ip A1:1" +
         colours + "\n";
}

/// Luma 16, 17, ... and then as many samples of chroma, which no light sees.
std::string frame(std::size_t chroma, const std::string& parameters = "") {
  std::string text = "FRAME" + parameters + "\n";
  for (int i = 0; i < 6; ++i) text += static_cast<char>(16 + i);
  return text + std::string(chroma, '\x77');
}

TEST_F(Y4m, luma_is_where_each_sampling_puts_it) {
  struct Case {
    const char* colours;
    std::size_t chroma;  // samples of a frame of 2 rows and 3 columns
  };
  for (const Case& one :
       {Case{"", 4}, Case{" C420jpeg XYSCSS=420JPEG", 4}, Case{" C420mpeg2", 4}, Case{" C411", 4},
        Case{" C422", 8}, Case{" C444", 12}, Case{" C444alpha", 18}, Case{" Cmono", 0}}) {
    const auto opened =
        Y4mReader::open(film(header(one.colours) + frame(one.chroma) + frame(one.chroma, " Ipp")));
    ASSERT_TRUE(opened.ok()) << one.colours << ": " << opened.error().line();
    EXPECT_EQ(opened->frames(), 2U);
    EXPECT_EQ(opened->grid(), (Grid{2, 3}));
    EXPECT_EQ(opened->rate().frames, 30000);
    EXPECT_EQ(opened->rate().seconds, 1001);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto luma = opened->luma(k);
      ASSERT_TRUE(luma.ok()) << one.colours;
      for (std::size_t i = 0; i < 6; ++i)
        EXPECT_FLOAT_EQ(luma->values()[i], static_cast<float>(i) / 219.F) << one.colours;
    }
  }
}

TEST_F(Y4m, codes_become_light_by_their_range_and_bits) {
  const auto first = [&](const std::string& head, const std::string& samples) {
    return Y4mReader::open(film(head + "FRAME\n" + samples)).value().luma(0).value().values()[0];
  };
  const auto eight = [](int code) { return std::string(1, static_cast<char>(code)); };
  const auto sixteen = [](int code) {
    return std::string{static_cast<char>(code & 255), static_cast<char>(code >> 8)};
  };
  const std::string limited = header(" Cmono", 1, 1), full = header(" Cmono XCOLORRANGE=FULL", 1, 1);
  EXPECT_EQ(first(limited, eight(16)), 0.F);
  EXPECT_EQ(first(limited, eight(235)), 1.F);
  EXPECT_EQ(first(limited, eight(3)), 0.F) << "below black";
  EXPECT_EQ(first(limited, eight(255)), 1.F) << "above white";
  EXPECT_EQ(first(full, eight(0)), 0.F);
  EXPECT_EQ(first(full, eight(255)), 1.F);
  EXPECT_FLOAT_EQ(first(full, eight(51)), 0.2F);
  EXPECT_EQ(first(header(" Cmono10", 1, 1), sixteen(940)), 1.F);
  EXPECT_FLOAT_EQ(first(header(" Cmono12 XCOLORRANGE=FULL", 1, 1), sixteen(819)), 0.2F);
  EXPECT_EQ(first(header(" C420p16", 1, 1), sixteen(235 << 8) + std::string(4, 'c')), 1.F);
}

TEST_F(Y4m, what_is_no_film_of_whole_pictures_is_refused) {
  const std::string whole = header(" Cmono") + frame(0) + frame(0);
  struct Case {
    std::string bytes;
    const char* word;
  };
  for (const Case& one :
       {Case{"", "not a YUV4MPEG2"}, Case{"RIFF....AVI ", "not a YUV4MPEG2"},
        Case{std::string("YUV4MPEG2 ") + std::string(500, 'x'), "not a YUV4MPEG2"},
        Case{header(" Cmono"), "no frame"}, Case{whole.substr(0, whole.size() - 1), "within frame 2"},
        Case{header(" Cmono") + frame(1) + frame(1), "frame 2 does not begin"},
        Case{header(" C410") + frame(9), "C410"}, Case{header(" Cmono99") + frame(9), "Cmono99"},
        Case{header(" C420p7") + frame(9), "C420p7"},
        Case{"YUV4MPEG2 W3 H2 It Cmono\n" + frame(0), "interlaced"},
        Case{"YUV4MPEG2 W3 H2 XCOLORRANGE=FULL\r\n" + frame(0), "CR LF"},
        Case{"YUV4MPEG2 W3x H2 Cmono\n" + frame(0), "W3x"},
        Case{"YUV4MPEG2 W3 F25 H2 Cmono\n" + frame(0), "F25"},
        Case{"YUV4MPEG2 W3 Cmono\n" + frame(0), "empty"},
        Case{"YUV4MPEG2 W-3 H2 Cmono\n" + frame(0), "empty"},
        Case{"YUV4MPEG2 W99999999 H99999999 Cmono\n" + frame(0), "at most"}}) {
    const auto opened = Y4mReader::open(film(one.bytes));
    ASSERT_FALSE(opened.ok()) << one.bytes.substr(0, 60);
    EXPECT_EQ(opened.error().code, ErrorCode::bad_format);
    EXPECT_NE(opened.error().line().find(one.word), std::string::npos) << opened.error().line();
  }
  EXPECT_EQ(Y4mReader::open(scratch_ / "nothing.y4m").error().code, ErrorCode::not_found);
  const auto opened = Y4mReader::open(film(whole));
  EXPECT_EQ(opened->luma(2).error().code, ErrorCode::bad_argument);
  // It became shorter after it was opened.
  fs::resize_file(scratch_ / "film.y4m", whole.size() - 3);
  EXPECT_EQ(opened->luma(1).error().code, ErrorCode::bad_format);
}

// Each byte of the header, changed in every bit: the film is refused or read, and no sample is read from
// beyond the file.
TEST_F(Y4m, a_flipped_bit_does_no_harm) {
  const std::string whole =
      header(" C420p10") + "FRAME\n" + std::string(20, 'a') + "FRAME\n" + std::string(20, 'b');
  const std::size_t head = header(" C420p10").size() + 6;
  for (std::size_t at = 0; at < head; ++at)
    for (int bit = 0; bit < 8; ++bit) {
      std::string changed = whole;
      changed[at] =
          static_cast<char>(static_cast<unsigned char>(changed[at]) ^ (1U << static_cast<unsigned>(bit)));
      const auto opened = Y4mReader::open(film(changed));
      if (!opened.ok()) continue;
      for (std::size_t k = 0; k < opened->frames(); ++k) EXPECT_TRUE(opened->luma(k).ok());
    }
}

TEST_F(Y4m, a_grey_film_keeps_its_codes) {
  Random random(3);
  const fs::path path = scratch_ / "out.y4m";
  std::vector<Image<std::uint8_t>> pictures(3, Image<std::uint8_t>({5, 4}));
  {
    auto film = Y4mWriter::begin(path, {5, 4}, 1, {24, 1});
    ASSERT_TRUE(film.ok());
    for (auto& picture : pictures) {
      for (std::uint8_t& code : picture.values()) code = static_cast<std::uint8_t>(256 * random.uniform());
      ASSERT_TRUE(film->add(picture).ok());
    }
    EXPECT_FALSE(fs::exists(path)) << "it is not finished";
    ASSERT_TRUE(film->finish().ok());
  }
  EXPECT_EQ(files(), 1U);
  const auto read = Y4mReader::open(path);
  ASSERT_TRUE(read.ok()) << read.error().line();
  ASSERT_EQ(read->frames(), 3U);
  EXPECT_EQ(read->rate().frames, 24);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto luma = read->luma(k).value();
    for (std::size_t i = 0; i < 20; ++i)
      EXPECT_FLOAT_EQ(luma.values()[i] * 255.F, static_cast<float>(pictures[k].values()[i]));
  }
}

// The inverse of JFIF's matrix: R = Y + 1.402 (Cr - 128), B = Y + 1.772 (Cb - 128). Each code is rounded
// once.
TEST_F(Y4m, a_colour_film_can_be_undone) {
  Image<std::uint8_t> picture({1, 4}, 3);
  const int colours[4][3] = {{255, 255, 255}, {200, 30, 90}, {0, 0, 0}, {10, 220, 128}};
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) picture.at(0, i, c) = static_cast<std::uint8_t>(colours[i][c]);
  const fs::path path = scratch_ / "out.y4m";
  auto film = Y4mWriter::begin(path, {1, 4}, 3, {});
  ASSERT_TRUE(film->add(picture).ok() && film->finish().ok());
  const std::string bytes = bytes_of(path);
  ASSERT_NE(bytes.find(" C444 XCOLORRANGE=FULL\nFRAME\n"), std::string::npos);
  const std::string planes = bytes.substr(bytes.size() - 12);
  for (int i = 0; i < 4; ++i) {
    const auto sample = [&](int plane) {
      return static_cast<double>(static_cast<unsigned char>(planes[4 * plane + i]));
    };
    EXPECT_NEAR(sample(0) + 1.402 * (sample(2) - 128), colours[i][0], 0.5 + 1.402 / 2 + 1e-9);
    EXPECT_NEAR(sample(0) + 1.772 * (sample(1) - 128), colours[i][2], 0.5 + 1.772 / 2 + 1e-9);
  }
}

// ITU-T T.871, section 7, before rounding. Weights in 65536ths are off by half of one each, three codes by
// 255 at most: 0.006. Rounding adds 0.5, and 255 is the largest code.
TEST_F(Y4m, colours_are_those_of_jfif) {
  Image<std::uint8_t> picture({52, 52 * 52}, 3);
  for (int r = 0; r < 52; ++r)
    for (int g = 0; g < 52; ++g)
      for (int b = 0; b < 52; ++b) {
        const int colour[3] = {5 * r, 5 * g, 5 * b};
        for (int c = 0; c < 3; ++c) picture.at(r, 52 * g + b, c) = static_cast<std::uint8_t>(colour[c]);
      }
  const std::vector<char> planes = Y4mWriter::planes_of(picture);
  const std::size_t pixels = picture.plane(0).size();
  ASSERT_EQ(planes.size(), 3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const double red = picture.plane(0)[i], green = picture.plane(1)[i], blue = picture.plane(2)[i];
    const double luma = 0.299 * red + 0.587 * green + 0.114 * blue;
    const double expected[3] = {luma, 128 + (blue - luma) / 1.772, 128 + (red - luma) / 1.402};
    for (std::size_t plane = 0; plane < 3; ++plane)
      ASSERT_NEAR(static_cast<unsigned char>(planes[plane * pixels + i]), std::min(expected[plane], 255.0),
                  0.506);
  }
}

TEST_F(Y4m, an_unfinished_film_leaves_nothing) {
  {
    auto film = Y4mWriter::begin(scratch_ / "out.y4m", {2, 2}, 1, {});
    ASSERT_TRUE(film->add(Image<std::uint8_t>({2, 2})).ok());
    EXPECT_EQ(film->add(Image<std::uint8_t>({2, 3})).error().code, ErrorCode::size_mismatch);
  }
  EXPECT_EQ(files(), 0U);
  EXPECT_FALSE(Y4mWriter::begin(scratch_ / "no" / "out.y4m", {2, 2}, 1, {}).ok());
  EXPECT_EQ(Y4mWriter::begin(scratch_ / "out.y4m", {2, 2}, 2, {}).error().code, ErrorCode::bad_argument);
}

}  // namespace
}  // namespace symrig::y4m_test
