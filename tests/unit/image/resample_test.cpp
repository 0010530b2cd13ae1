// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/resample.hpp"

#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::resample_test {
namespace {

Image<float> row_of(const std::vector<float>& values) {
  Image<float> image({1, static_cast<int>(values.size())});
  std::copy(values.begin(), values.end(), image.values().begin());
  return image;
}

double mean(const Image<float>& image) {
  return std::accumulate(image.values().begin(), image.values().end(), 0.0) /
         static_cast<double>(image.values().size());
}

TEST(ResizeNearest, TakesThePixelUnderTheCentre) {
  EXPECT_EQ(resize_nearest(row_of({1, 2, 3, 4, 5, 6}), {1, 3}), row_of({2, 4, 6}));
  EXPECT_EQ(resize_nearest(row_of({1, 2, 3}), {1, 6}), row_of({1, 1, 2, 2, 3, 3}));
  EXPECT_EQ(resize_nearest(row_of({1, 2, 3}), {2, 3}).grid(), (Grid{2, 3}));
}

TEST(ResizeBox, AveragesByArea) {
  // Three pixels to two: each new one covers one and a half old ones.
  const auto two = resize_box(row_of({3, 6, 12}), {1, 2});
  EXPECT_FLOAT_EQ(two.at(0, 0), (3 + 0.5F * 6) / 1.5F);
  EXPECT_FLOAT_EQ(two.at(0, 1), (0.5F * 6 + 12) / 1.5F);
  EXPECT_EQ(resize_box(row_of({1, 2, 3}), {1, 3}), row_of({1, 2, 3}));
}

TEST(ResizeBox, KeepsTheMean) {
  Image<float> image({13, 17});
  for (std::size_t i = 0; i < image.values().size(); ++i) image.values()[i] = static_cast<float>(i * i % 101);
  for (const Grid grid : {Grid{1, 1}, Grid{5, 4}, Grid{13, 17}, Grid{29, 31}})
    EXPECT_NEAR(mean(resize_box(image, grid)), mean(image), 1e-5 * mean(image))
        << to_string(grid);  // float sums
}

TEST(Resize, OfNothingIsNothing) {
  EXPECT_TRUE(resize_nearest({}, {2, 2}).empty());
  EXPECT_TRUE(resize_box(row_of({1}), {0, 2}).empty());
}

TEST(ToGray, WeighsLuminance) {
  Image<float> image({1, 1}, 3);
  image.at(0, 0, 0) = 1;
  image.at(0, 0, 1) = 10;
  image.at(0, 0, 2) = 100;
  EXPECT_FLOAT_EQ(to_gray(image).at(0, 0), 0.2126F + 7.152F + 7.22F);
  EXPECT_EQ(to_gray(row_of({1, 2})), row_of({1, 2}));
}

}  // namespace
}  // namespace symrig::resample_test
