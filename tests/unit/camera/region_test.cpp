// SPDX-License-Identifier: Apache-2.0
#include "assert_ok.hpp"
#include "symrig/camera/frame_format.hpp"
#include "symrig/camera/internal/frame_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::region_test {
namespace {

using camera::FrameReader;
using camera::PictureLayout;

constexpr int kNeverSaturated = 1 << 20;

/// What a pixel sees; the greens beside red (g) and beside blue (G) are two colours.
char colour(Mosaic mosaic, int row, int col) {
  constexpr std::array<std::string_view, 5> kSquares{"xxxx", "rgGb", "grbG", "Gbrg", "bGgr"};
  return kSquares.at(static_cast<std::size_t>(
      mosaic))[2 * (static_cast<unsigned>(row) & 1U) + (static_cast<unsigned>(col) & 1U)];
}

TEST(Mosaic, shifting_by_a_pixel_shows_the_colours_that_are_there) {
  for (const Mosaic mosaic : {Mosaic::rggb, Mosaic::grbg, Mosaic::gbrg, Mosaic::bggr})
    for (int row = 0; row < 3; ++row)
      for (int col = 0; col < 3; ++col) {
        const std::string_view seen = name(shifted(mosaic, row, col));
        for (int r = 0; r < 2; ++r)
          for (int c = 0; c < 2; ++c)
            EXPECT_EQ(seen[2 * r + c], name(mosaic)[2 * ((row + r) & 1) + ((col + c) & 1)]);
      }
  EXPECT_EQ(shifted(Mosaic::none, 1, 1), Mosaic::none);
}

TEST(Mosaic, filters_are_those_of_its_name) {
  for (const auto& [mosaic, bayer] : {std::pair(Mosaic::rggb, "RGGB"), std::pair(Mosaic::grbg, "GRBG"),
                                      std::pair(Mosaic::gbrg, "GBRG"), std::pair(Mosaic::bggr, "BGGR")})
    EXPECT_EQ(filters(mosaic).colours, parse_bayer(bayer)->colours) << bayer;
}

/// A picture of 16-bit words with its layout; stride is longer than a row needs.
struct Picture {
  Picture(Grid size, const char* format, int bits, std::uint32_t seed)
      : layout{find_pixel_format(format), {bits, 0}, size, static_cast<std::size_t>(size.cols) * 2 + 6},
        bytes(layout.stride * static_cast<std::size_t>(size.rows)) {
    std::mt19937 random(seed);
    for (int row = 0; row < size.rows; ++row)
      for (int col = 0; col < size.cols; ++col)
        set(row, col, static_cast<std::uint16_t>(random() & ((1U << bits) - 1)));
  }
  std::size_t at(int row, int col) const {
    return layout.stride * static_cast<std::size_t>(row) + 2 * static_cast<std::size_t>(col);
  }
  void set(int row, int col, std::uint16_t code) {
    bytes[at(row, col)] = static_cast<std::byte>(code & 255U);
    bytes[at(row, col) + 1] = static_cast<std::byte>(code >> 8);
  }
  std::uint16_t get(int row, int col) const {
    return static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[at(row, col)]) |
                                      std::to_integer<unsigned>(bytes[at(row, col) + 1]) << 8);
  }
  PictureLayout layout;
  std::vector<std::byte> bytes;
};

/// The obvious way: for each pixel of the result, all pixels of its square that have its colour.
std::uint32_t slow_sum(const Picture& picture, const Region& region, Mosaic mosaic, int row, int col) {
  const int step = mosaic == Mosaic::none ? 1 : 2;
  const int square = region.binning * step;
  const int row0 = region.row + row / step * square, col0 = region.col + col / step * square;
  const char wanted = colour(mosaic, region.row + row % step, region.col + col % step);
  std::uint32_t sum = 0;
  for (int r = row0; r < row0 + square; ++r)
    for (int c = col0; c < col0 + square; ++c)
      if (mosaic == Mosaic::none || colour(mosaic, r, c) == wanted) sum += picture.get(r, c);
  return sum;
}

void expect_sums(const char* format, int bits, const Region& region) {
  const Picture picture({20, 26}, format, bits, 1);
  const Mosaic mosaic = picture.layout.format->mosaic;
  const auto to = binned_grid(picture.layout.size, mosaic, region);
  ASSERT_OK(to);
  FrameReader reader(picture.layout, region, kNeverSaturated);
  std::vector<std::uint16_t> codes(to->grid.size());
  reader.read(picture.bytes, codes);
  const int shift = binning_shift(bits, region.binning);
  for (int row = 0; row < to->grid.rows; ++row)
    for (int col = 0; col < to->grid.cols; ++col) {
      const double exact = std::ldexp(slow_sum(picture, region, mosaic, row, col), -shift);
      const int code = codes[static_cast<std::size_t>(row) * static_cast<std::size_t>(to->grid.cols) +
                             static_cast<std::size_t>(col)];
      EXPECT_LE(std::abs(code - exact), shift == 0 ? 0 : 0.5) << format << " " << row << " " << col;
    }
}

TEST(FrameReader, sums_are_those_of_the_slow_way) {
  expect_sums("Y12", 12, {});
  expect_sums("Y12", 12, {3, 5, {10, 11}, 1});
  expect_sums("Y12", 12, {1, 1, {18, 24}, 3});
  expect_sums("Y16", 16, {0, 0, {20, 24}, 4});  // 20 bits: 4 are rounded off
  expect_sums("SRGGB12", 12, {0, 0, {20, 24}, 2});
  expect_sums("SGRBG12", 12, {3, 5, {12, 12}, 3});
  expect_sums("SBGGR16", 16, {1, 0, {16, 16}, 2});
}

TEST(FrameReader, a_region_of_packed_samples_may_begin_inside_of_a_group) {
  const PixelFormat& format = *find_pixel_format("Y10P");
  const Grid size{3, 12};
  std::mt19937 random(3);
  std::vector<std::byte> bytes(3 * row_bytes(format, 12));
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  const PictureLayout layout{&format, {10, 0}, size, row_bytes(format, 12)};
  std::vector<std::uint16_t> whole(36), part(static_cast<std::size_t>(2 * 5));
  FrameReader(layout, {}, kNeverSaturated).read(bytes, whole);
  for (int col = 0; col < 7; ++col) {
    FrameReader(layout, {1, col, {2, 5}, 1}, kNeverSaturated).read(bytes, part);
    for (int k = 0; k < 10; ++k) EXPECT_EQ(part[k], whole[(1 + k / 5) * 12 + col + k % 5]) << col;
  }
}

TEST(FrameReader, one_saturated_sample_saturates_its_bin) {
  Picture picture({4, 4}, "Y12", 12, 9);
  for (int row = 0; row < 4; ++row)
    for (int col = 0; col < 4; ++col) picture.set(row, col, 100);
  picture.set(1, 2, 4090);
  std::vector<std::uint16_t> codes(4);
  FrameReader(picture.layout, {0, 0, {}, 2}, 4090).read(picture.bytes, codes);
  const NoiseModel sum = binned(NoiseModel::from_electrons({}), 2);
  EXPECT_EQ(codes, (std::vector<std::uint16_t>{400, static_cast<std::uint16_t>(sum.max_code()), 400, 400}));
  EXPECT_GE(codes[1], sum.saturation_code());
}

TEST(FrameReader, rows_that_did_not_come_are_zero_and_not_an_old_picture) {
  const Picture picture({4, 4}, "Y12", 12, 2);
  std::vector<std::uint16_t> codes(16, 77);
  const auto some =
      std::span(picture.bytes).first(picture.layout.stride + 9);  // one row and one byte too few
  FrameReader(picture.layout, {}, kNeverSaturated).read(some, codes);
  EXPECT_EQ(codes[3], picture.get(0, 3));
  EXPECT_TRUE(std::all_of(codes.begin() + 4 + 4, codes.end(), [](auto code) { return code == 0; }));
}

TEST(Region, what_cannot_be_says_what_can) {
  const Grid picture{100, 200};
  const auto line = [&](Mosaic mosaic, const Region& region) {
    const auto grid = binned_grid(picture, mosaic, region);
    return grid ? std::string("taken") : grid.error().line();
  };
  EXPECT_EQ(line(Mosaic::none, {}), "taken");
  EXPECT_EQ(line(Mosaic::none, {0, 0, {99, 198}, 3}), "taken");
  EXPECT_NE(line(Mosaic::none, {0, 0, {100, 198}, 3}).find("99x198"), std::string::npos);
  EXPECT_NE(line(Mosaic::rggb, {0, 0, {98, 198}, 2}).find("96x196"), std::string::npos);
  EXPECT_NE(line(Mosaic::none, {60, 0, {50, 10}, 1}).find("is not inside the picture of 100x200"),
            std::string::npos);
  EXPECT_NE(line(Mosaic::none, {-1, 0, {}, 1}).find("is not inside"), std::string::npos);
  EXPECT_NE(line(Mosaic::none, {100, 0, {}, 1}).find("is not inside"), std::string::npos);
  EXPECT_NE(line(Mosaic::none, {0, 0, {}, 0}).find("1 to 64"), std::string::npos);
  EXPECT_NE(line(Mosaic::none, {0, 0, {2, 2}, 3}).find("larger region"), std::string::npos);
}

// Samples drawn from the sensor's model, binned as frames are: mean and variance of the sums must be those
// that the binned model foretells. Bounds: 5 standard errors of the mean and of a variance, √(2/N).
class BinnedNoise : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(BinnedNoise, is_what_sums_of_samples_have) {
  const auto [bits, binning] = GetParam();
  const NoiseModel sensor = NoiseModel::from_electrons(
      {.full_well = 20'000, .read_noise = 3, .bits = bits, .pedestal = 0.1 * (1 << bits)});
  const NoiseModel sum = binned(sensor, binning);
  ASSERT_TRUE(sum.valid()) << sum.to_string();
  constexpr double kElectrons = 400;
  const int side = 150;
  const Grid size{side * binning, side * binning};
  Picture picture(size, "Y16", bits, 4);
  std::mt19937_64 random(5);
  std::normal_distribution<double> light(kElectrons, std::sqrt(kElectrons)), read(0, sensor.read_noise());
  for (int row = 0; row < size.rows; ++row)
    for (int col = 0; col < size.cols; ++col)
      picture.set(row, col,
                  static_cast<std::uint16_t>(
                      std::lround(sensor.pedestal() + sensor.gain() * (light(random) + read(random)))));
  std::vector<std::uint16_t> codes(static_cast<std::size_t>(side) * side);
  FrameReader(picture.layout, {0, 0, {}, binning}, sensor.saturation_code()).read(picture.bytes, codes);

  const auto n = static_cast<double>(codes.size());
  double mean = 0, variance = 0;
  for (const auto code : codes) mean += (code - sum.pedestal()) / sum.gain() / n;
  for (const auto code : codes)
    variance += std::pow((code - sum.pedestal()) / sum.gain() - mean, 2) / (n - 1);
  const double electrons = binning * binning * kElectrons;
  const double foretold = sum.variance(electrons);
  // Rounding half up is off by half a lost unit at most.
  EXPECT_NEAR(mean, electrons, 5 * std::sqrt(foretold / n) + 0.5 / sum.gain());
  EXPECT_NEAR(variance / foretold, 1, 5 * std::sqrt(2 / n));
  EXPECT_NEAR(sum.pedestal(),
              std::ldexp(binning * binning * sensor.pedestal(), -binning_shift(bits, binning)), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Region, BinnedNoise,
                         testing::Values(std::pair{12, 1}, std::pair{12, 2}, std::pair{10, 3},
                                         std::pair{12, 5}, std::pair{16, 2}, std::pair{14, 4}));

TEST(Region, a_single_sample_keeps_its_model) {
  const NoiseModel sensor = NoiseModel::from_electrons({});
  const NoiseModel same = binned(sensor, 1);
  EXPECT_NEAR(same.read_noise(), sensor.read_noise(), 1e-9);
  EXPECT_NEAR(same.gain(), sensor.gain(), 1e-12);
  EXPECT_EQ(same.saturation_code(), sensor.saturation_code());
}

}  // namespace
}  // namespace symrig::region_test
