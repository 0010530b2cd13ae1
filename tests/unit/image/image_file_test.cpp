// SPDX-License-Identifier: Apache-2.0
#include "scratch.hpp"
#include "symrig/base/files.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string_view>

#include <gtest/gtest.h>

namespace symrig::image_file_test {
namespace {

namespace fs = std::filesystem;

std::vector<std::byte> bytes_of(const std::vector<int>& codes) {
  std::vector<std::byte> bytes;
  bytes.reserve(codes.size());
  for (const int code : codes) bytes.push_back(static_cast<std::byte>(code));
  return bytes;
}

/// A folder that goes with the test.
class ImageFile : public testing::Test {
 protected:
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }

  test::Scratch scratch_;
  const fs::path& folder_ = scratch_.folder();
};

/// Values that neither format may bend: negative, above 1, tiny, large.
Image<float> picture(Grid grid, int channels) {
  Image<float> image(grid, channels);
  float v = -2.5F;
  for (float& x : image.values()) x = v += 0.37F;
  image.at(0, 0) = 1e-20F;
  image.at(grid.rows - 1, grid.cols - 1, channels - 1) = 6e20F;
  return image;
}

TEST_F(ImageFile, AnExrKeepsItsFacts) {
  const PictureFacts facts{.units = "radiance",
                           .exposure = 0.25,
                           .view = "camera, seen from view 0,1",
                           .light = "letters \xC3\xA9.exr",
                           .scene = std::string(64, 'a')};
  const fs::path with = folder_ / "with.exr", without = folder_ / "without.exr", pfm = folder_ / "a.pfm";
  const auto image = picture({5, 7}, 3);
  ASSERT_TRUE(write_image(with, image, facts).ok());
  ASSERT_TRUE(write_image(without, image).ok());
  ASSERT_TRUE(write_image(pfm, image, facts).ok());
  EXPECT_EQ(read_picture_facts(with).value(), facts);
  EXPECT_EQ(read_picture_facts(without).value(), PictureFacts{});
  EXPECT_EQ(read_picture_facts(pfm).value(), PictureFacts{});
  EXPECT_EQ(read_image(with).value(), image);
  EXPECT_EQ(read_image(without).value(), image);
}

/// Puts another display window into an OpenEXR file: x and y of its first and last pixel.
void show_window(const fs::path& path, std::array<std::int32_t, 4> window) {
  auto bytes = read_file(path).value();
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string_view head("displayWindow\0box2i\0\x10\0\0\0", 24);
  ASSERT_NE(text.find(head), std::string_view::npos);
  std::memcpy(bytes.data() + text.find(head) + head.size(), window.data(), sizeof window);
  ASSERT_TRUE(write_file_atomically(path, bytes).ok());
}

// The display window is the picture. A crop has fewer pixels, a picture with a margin has more.
TEST_F(ImageFile, AnExrIsWhatItsDisplayWindowShows) {
  const fs::path path = folder_ / "window.exr";
  const auto image = picture({3, 4}, 3);
  ASSERT_TRUE(write_image(path, image).ok());
  show_window(path, {-2, -1, 5, 4});
  const auto crop = read_image(path);
  ASSERT_TRUE(crop.ok()) << crop.error().line();
  ASSERT_EQ(crop->grid(), (Grid{6, 8}));
  for (int c = 0; c < 3; ++c)
    for (int row = 0; row < 6; ++row)
      for (int col = 0; col < 8; ++col) {
        const bool held = row >= 1 && row < 4 && col >= 2 && col < 6;
        EXPECT_EQ(crop->at(row, col, c), held ? image.at(row - 1, col - 2, c) : 0) << row << ", " << col;
      }
  show_window(path, {1, 1, 2, 2});
  const auto inner = read_image(path);
  ASSERT_TRUE(inner.ok()) << inner.error().line();
  ASSERT_EQ(inner->grid(), (Grid{2, 2}));
  EXPECT_EQ(inner->at(1, 0, 2), image.at(2, 1, 2));
  show_window(path, {100, 100, 103, 102});
  EXPECT_NE(read_image(path).error().what.find("outside of its display window"), std::string::npos);
  show_window(path, {0, 0, 2'000'000'000, 2'000'000'000});
  EXPECT_EQ(read_image(path).error().code, ErrorCode::bad_format);
}

TEST_F(ImageFile, ADamagedHeaderStatesNothing) {
  const fs::path path = folder_ / "facts.exr";
  ASSERT_TRUE(write_image(path, picture({5, 7}, 1), {.units = "radiance", .exposure = 2}).ok());
  const auto whole = read_file(path).value();
  int read = 0;
  for (std::size_t cut = 0; cut < whole.size(); ++cut) {
    ASSERT_TRUE(write_file_atomically(path, std::span(whole).first(cut)).ok());
    const auto facts = read_picture_facts(path);
    if (!facts) {
      EXPECT_EQ(facts.error().code, ErrorCode::bad_format) << cut;
    } else if (facts->exposure) {
      ++read;
      EXPECT_EQ(facts->exposure, 2.0);
    }
  }
  EXPECT_GT(read, 0);  // of files whose header is whole
}

class FloatFormats : public ImageFile, public testing::WithParamInterface<std::tuple<const char*, int>> {};

TEST_P(FloatFormats, KeepEveryBit) {
  const auto& [suffix, channels] = GetParam();
  for (const Grid grid : {Grid{1, 1}, Grid{5, 7}, Grid{64, 33}}) {
    const auto image = picture(grid, channels);
    const fs::path path = folder_ / (std::string("picture") + suffix);
    ASSERT_TRUE(write_image(path, image).ok());
    const auto read = read_image(path);
    ASSERT_TRUE(read.ok()) << read.error().line();
    EXPECT_EQ(*read, image);
  }
  EXPECT_EQ(files(), 1U);  // no temporary file stays
}
INSTANTIATE_TEST_SUITE_P(All, FloatFormats,
                         testing::Combine(testing::Values(".exr", ".pfm", ".EXR"), testing::Values(1, 3)));

TEST_F(ImageFile, SixteenBitPngIsLinearAndClipped) {
  Image<float> image({1, 4});
  image.at(0, 0) = -0.5F;
  image.at(0, 1) = 0.25F;
  image.at(0, 2) = 1.0F;
  image.at(0, 3) = 7.0F;
  ASSERT_TRUE(write_image(folder_ / "a.png", image).ok());
  const auto read = read_image(folder_ / "a.png");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->at(0, 0), 0);
  EXPECT_NEAR(read->at(0, 1), 0.25, 0.5 / 65'535);  // rounding of one code
  EXPECT_EQ(read->at(0, 2), 1);
  EXPECT_EQ(read->at(0, 3), 1);
}

// Against IEC 61966-2-1 itself, for values of every size, and next to each place where the code changes.
TEST_F(ImageFile, EveryValueHasTheCodeOfTheToneCurve) {
  const auto by_formula = [](double v) {
    const double x = std::clamp(v, 0.0, 1.0);
    return std::lround(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055));
  };
  using Limits = std::numeric_limits<float>;
  std::vector<float> values{
      0.F,    1.F,   2.F,           1e-30F, 1e30F, Limits::denorm_min(), -1.F, -0.F, Limits::min(),
      -1e30F, 1e-9F, Limits::max(), 1e9F,   1e-4F, Limits::infinity()};
  for (int i = 0; i < 200'000; ++i) values.push_back(static_cast<float>(i) / 180'000.F);
  for (int code = 1; code < 256; ++code) {
    const double edge = (code - 0.5) / 255;
    const auto linear =
        static_cast<float>(edge <= 0.04045 ? edge / 12.92 : std::pow((edge + 0.055) / 1.055, 2.4));
    for (const float near : {linear, std::nextafter(linear, 0.F), std::nextafter(linear, 2.F)})
      values.push_back(near);
  }
  Image<float> image({1, static_cast<int>(values.size())});
  std::ranges::copy(values, image.values().begin());
  // The largest and smallest: all floats, and none, are bright. 1e40: the curve begins among denormal
  // numbers.
  for (const double exposure : {1.0, 0.7, 3e-5, 4e7, 1e-38, 1e38, 1e40, 1e-300, 1e300}) {
    const auto shown = to_display(image, exposure);
    for (std::size_t i = 0; i < values.size(); ++i)
      ASSERT_EQ(shown.values()[i], by_formula(exposure * static_cast<double>(values[i]))) << values[i];
  }
  Image<float> dark({1, 2});
  dark.at(0, 0) = -1, dark.at(0, 1) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(to_display(dark), Image<std::uint8_t>({1, 2}));
}

TEST_F(ImageFile, DisplayPngIsSrgb) {
  // IEC 61966-2-1 by hand: 0.0031308 → 0.04045 (10.3), 0.5 → 0.735357 (187.5), 0.18 → 0.461356 (117.6).
  Image<float> image({1, 5});
  std::ranges::copy(std::vector<float>{0.0031308F, 0.5F, 0.18F, -1.0F, 2.0F}, image.values().begin());
  const auto display = to_display(image);
  EXPECT_EQ(std::vector<int>(display.values().begin(), display.values().end()),
            (std::vector<int>{10, 188, 118, 0, 255}));
  EXPECT_EQ(to_display(image, 0.36).at(0, 1), 118);  // exposure: 0.36 · 0.5 = 0.18
  ASSERT_TRUE(write_display_png(folder_ / "a.png", image).ok());
  const auto read = read_image(folder_ / "a.png");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(std::lround(255 * read->at(0, 2)), 118);
  EXPECT_EQ(write_display_png(folder_ / "b.png", image, -1).error().code, ErrorCode::bad_argument);
}

TEST_F(ImageFile, PngInMemoryIsThePicture) {
  Image<std::uint8_t> image({3, 2}, 3);
  int code = 0;
  for (auto& v : image.values()) v = static_cast<std::uint8_t>(code += 13);
  const auto png = encode_png(image);
  const auto read = decode_image(std::as_bytes(std::span(png)), "memory");
  ASSERT_TRUE(read.ok()) << read.error().line();
  ASSERT_EQ(read->channels(), 3);
  for (std::size_t i = 0; i < png.size() && i < image.values().size(); ++i)
    EXPECT_EQ(std::lround(255 * read->values()[i]), image.values()[i]);
  EXPECT_TRUE(encode_png(Image<std::uint8_t>({2, 2}, 2)).empty());
  EXPECT_TRUE(encode_png({}).empty());
}

TEST(DecodePng, AlphaIsDroppedAndColoursStayAsStored) {
  // 1 × 1 RGBA8: 255, 128, 0 at alpha 10; one stored deflate block.
  const auto png =
      bytes_of({0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A, 0x00, 0x00, 0x00, 0x0D, 0x49, 0x48, 0x44,
                0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x06, 0x00, 0x00, 0x00, 0x1F,
                0x15, 0xC4, 0x89, 0x00, 0x00, 0x00, 0x10, 0x49, 0x44, 0x41, 0x54, 0x78, 0x01, 0x01, 0x05,
                0x00, 0xFA, 0xFF, 0x00, 0xFF, 0x80, 0x00, 0x0A, 0x05, 0x8B, 0x01, 0x8A, 0x3F, 0x91, 0xCC,
                0xDC, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4E, 0x44, 0xAE, 0x42, 0x60, 0x82});
  const auto read = decode_image(png, "alpha.png");
  ASSERT_TRUE(read.ok()) << read.error().line();
  ASSERT_EQ(read->channels(), 3);
  EXPECT_EQ(read->at(0, 0, 0), 1);
  EXPECT_NEAR(read->at(0, 0, 1), 128.0 / 255, 1e-7);
  EXPECT_EQ(read->at(0, 0, 2), 0);
}

TEST_F(ImageFile, ContentDecidesNotTheName) {
  const auto image = picture({4, 4}, 1);
  ASSERT_TRUE(write_image(folder_ / "a.exr", image).ok());
  fs::rename(folder_ / "a.exr", folder_ / "a.png");
  const auto read = read_image(folder_ / "a.png");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(*read, image);
}

TEST_F(ImageFile, NotANumberIsRefusedByName) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    Image<float> image({3, 4}, 3, 0.5F);
    image.at(1, 2, 1) = bad;
    const auto written = write_image(folder_ / "a.exr", image);
    ASSERT_FALSE(written.ok());
    EXPECT_EQ(written.error().code, ErrorCode::bad_value);
    EXPECT_EQ(files(), 0U);
  }
  // A file made elsewhere: PFM, 2 × 2, second value of the top row is NaN. Rows are stored from the bottom
  // up.
  const std::string header = "Pf\n2 2\n-1.0\n";
  const float values[] = {1, 2, 3, std::numeric_limits<float>::quiet_NaN()};
  std::string file = header;
  file.append(reinterpret_cast<const char*>(values), sizeof values);
  ASSERT_TRUE(write_file_atomically(folder_ / "nan.pfm", file).ok());
  const auto read = read_image(folder_ / "nan.pfm");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::bad_value);
  EXPECT_NE(read.error().what.find("row 0, column 1"), std::string::npos) << read.error().line();
}

TEST_F(ImageFile, BigEndianPfmIsRead) {
  // 1.0 = 3F 80 00 00, 2.0 = 40 00 00 00.
  std::string file = "Pf\n2 1\n1.0\n";
  for (const int c : {0x3F, 0x80, 0, 0, 0x40, 0, 0, 0}) file += static_cast<char>(c);
  ASSERT_TRUE(write_file_atomically(folder_ / "a.pfm", file).ok());
  const auto read = read_image(folder_ / "a.pfm");
  ASSERT_TRUE(read.ok()) << read.error().line();
  EXPECT_EQ(read->at(0, 0), 1);
  EXPECT_EQ(read->at(0, 1), 2);
}

/// The bytes of a PFM of one row, whose header ends with `end`.
std::string pfm_that_ends(const std::string& line, const std::string& end, std::span<const float> values) {
  std::string file = "Pf" + line + std::to_string(values.size()) + " 1" + line + "-1.0" + end;
  return file.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

TEST_F(ImageFile, APfmMayEndItsLinesInAnyWay) {
  // The pixels of the second picture begin with the bytes of LF, CR and a blank.
  const float plain[] = {0.1F, 0.7F}, like_text[] = {std::bit_cast<float>(0x3F200D0AU), 2};
  const std::string lines[] = {"\n", "\r\n", "\r", " \n", " \r\n", "  ", "\t"};
  for (const auto& values : {std::span<const float>(plain), std::span<const float>(like_text)})
    for (const std::string& line : lines)
      for (const char* end : {"\n", "\r\n", "\r", " ", " \n", "\t \r\n"}) {
        const std::string file = pfm_that_ends(line, end, values);
        const auto read = decode_image(std::as_bytes(std::span(file)), "lines.pfm");
        ASSERT_TRUE(read.ok()) << read.error().line();
        EXPECT_EQ(read->at(0, 0), values[0]) << testing::PrintToString(file);
        EXPECT_EQ(read->at(0, 1), values[1]) << testing::PrintToString(file);
      }
}

TEST_F(ImageFile, APfmWithBytesTooManyIsRefused) {
  // What a copy as text makes of a pixel that contains the byte 10; a second LF; a file with a tail.
  const float values[] = {std::bit_cast<float>(0x3F200A0DU), 2};
  std::string as_text = pfm_that_ends("\r\n", "\r\n", values);
  as_text.insert(as_text.find("\r\n", as_text.find("-1.0") + 6) + 1, "\r");
  for (const std::string& file :
       {as_text, pfm_that_ends("\n", "\n\n", values), pfm_that_ends("\n", "\n", values) + '\n'}) {
    const auto read = decode_image(std::as_bytes(std::span(file)), "tail.pfm");
    ASSERT_FALSE(read.ok()) << testing::PrintToString(file);
    EXPECT_EQ(read.error().code, ErrorCode::bad_format);
    EXPECT_NE(read.error().what.find("after the scale"), std::string::npos) << read.error().line();
  }
}

TEST_F(ImageFile, MissingFileAndFolder) {
  EXPECT_EQ(read_image(folder_ / "none.exr").error().code, ErrorCode::not_found);
  EXPECT_EQ(read_image(folder_).error().code, ErrorCode::io);
  EXPECT_EQ(write_image(folder_ / "none" / "a.exr", picture({2, 2}, 1)).error().code, ErrorCode::not_found);
  EXPECT_EQ(write_image(folder_, picture({2, 2}, 1)).error().code, ErrorCode::bad_argument);  // no suffix
  EXPECT_EQ(write_image(folder_ / "a.jpg", picture({2, 2}, 1)).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(write_image(folder_ / "a.exr", picture({2, 2}, 2)).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(write_image(folder_ / "a.exr", {}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(files(), 0U);
}

class Damaged : public ImageFile, public testing::WithParamInterface<const char*> {};

TEST_P(Damaged, EveryTruncationIsRefused) {
  const fs::path path = folder_ / (std::string("a") + GetParam());
  Image<float> image({9, 11}, 3);
  for (std::size_t i = 0; i < image.values().size(); ++i) image.values()[i] = static_cast<float>(i % 17) / 17;
  ASSERT_TRUE(write_image(path, image).ok());
  const auto whole = read_file(path);
  ASSERT_TRUE(whole.ok());
  for (std::size_t length = 0; length < whole->size(); ++length) {
    const auto read = decode_image(std::span(*whole).first(length), "cut");
    ASSERT_FALSE(read.ok()) << length << " of " << whole->size() << " bytes were taken for a picture";
    EXPECT_TRUE(read.error().code == ErrorCode::bad_format || read.error().code == ErrorCode::bad_value);
  }
}

TEST_P(Damaged, FlippedBytesNeverCrash) {
  const fs::path path = folder_ / (std::string("a") + GetParam());
  ASSERT_TRUE(write_image(path, Image<float>({6, 5}, 1, 0.25F)).ok());
  const auto whole = read_file(path);
  ASSERT_TRUE(whole.ok());
  int refused = 0;
  for (std::size_t at = 0; at < whole->size(); ++at) {
    for (const int flip : {0x01, 0x80, 0xFF}) {
      auto bytes = *whole;
      bytes[at] ^= static_cast<std::byte>(flip);
      const auto read = decode_image(bytes, "flipped");
      refused += read.ok() ? 0 : 1;
      EXPECT_TRUE(!read.ok() || read->grid().size() <= kMaxPicturePixels);
    }
  }
  EXPECT_GT(refused, 0);
}
INSTANTIATE_TEST_SUITE_P(All, Damaged, testing::Values(".exr", ".png", ".pfm"));

TEST(DecodeImage, HugeHeadersAreRefusedBeforeAllocation) {
  // 2³⁰ × 2³⁰ floats would be 4 EiB: an allocation would throw or be killed; a header check answers at once.
  const std::string pfm = "PF\n1073741824 1073741824\n-1.0\n";
  const auto read = decode_image(std::as_bytes(std::span(pfm)), "huge.pfm");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::bad_format);
  EXPECT_NE(read.error().what.find("1073741824x1073741824"), std::string::npos);
  // PNG of 2³¹ − 1 by 2³¹ − 1 pixels, check sums right.
  const auto png = bytes_of({0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A, 0x00, 0x00, 0x00, 0x0D, 0x49,
                             0x48, 0x44, 0x52, 0x7F, 0xFF, 0xFF, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF, 0x08, 0x00,
                             0x00, 0x00, 0x00, 0x31, 0xA2, 0x54, 0xBA, 0x00, 0x00, 0x00, 0x10, 0x49, 0x44,
                             0x41, 0x54, 0x78, 0x01, 0x01, 0x05, 0x00, 0xFA, 0xFF, 0x00, 0xFF, 0x80, 0x00,
                             0x0A, 0x05, 0x8B, 0x01, 0x8A, 0x3F, 0x91, 0xCC, 0xDC});
  const auto read_png = decode_image(png, "huge.png");
  ASSERT_FALSE(read_png.ok());
  EXPECT_EQ(read_png.error().code, ErrorCode::bad_format);
  EXPECT_NE(read_png.error().what.find("2147483647x2147483647"), std::string::npos)
      << read_png.error().line();
}

TEST(DecodeImage, OtherContentIsNotAPicture) {
  const std::string text = "hello, this is text";
  const auto read = decode_image(std::as_bytes(std::span(text)), "notes.txt");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::bad_format);
  EXPECT_EQ(decode_image({}, "empty").error().code, ErrorCode::bad_format);
}

TEST_F(ImageFile, WritingReplacesTheWholeFileOrNothing) {
  const fs::path path = folder_ / "a.pfm";
  ASSERT_TRUE(write_image(path, picture({8, 8}, 1)).ok());
  const auto before = read_file(path);
  Image<float> bad({8, 8});
  bad.at(3, 3) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(write_image(path, bad).ok());
  EXPECT_EQ(*read_file(path), *before);
  ASSERT_TRUE(write_image(path, picture({2, 2}, 1)).ok());
  EXPECT_EQ(read_image(path)->grid(), (Grid{2, 2}));
  EXPECT_EQ(files(), 1U);
}

TEST_F(ImageFile, AtomicWritesFollowLinksAndRefuseFolders) {
  ASSERT_TRUE(write_file_atomically(folder_ / "target", std::string_view("one")).ok());
  fs::create_symlink(folder_ / "target", folder_ / "link");
  ASSERT_TRUE(write_file_atomically(folder_ / "link", std::string_view("two")).ok());
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(fs::file_size(folder_ / "target"), 3U);
  EXPECT_EQ(write_file_atomically(folder_, std::string_view("x")).error().code, ErrorCode::io);
  EXPECT_EQ(write_file_atomically("/dev/null", std::string_view("x")).error().code, ErrorCode::io);
  EXPECT_EQ(read_file(folder_ / "target", 2).error().code, ErrorCode::limit);
}

}  // namespace
}  // namespace symrig::image_file_test
