// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/memory.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/outline.hpp"
#include "symrig/image/stored_image.hpp"

#include <cmath>
#include <filesystem>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
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

namespace symrig::outline_test {
namespace {

double total(const std::vector<Overlap>& overlaps) {
  double sum = 0;
  for (const Overlap& o : overlaps) sum += o.area;
  return sum;
}

/// A square of this side around a middle, turned.
Outline square(Point middle, double side, double degrees) {
  const double half = side / std::numbers::sqrt2, turn = (degrees + 45) * std::numbers::pi / 180;
  Outline outline;
  for (std::size_t k = 0; k < 4; ++k) {
    const double angle = turn + static_cast<double>(k) * std::numbers::pi / 2;
    outline[k] = {middle.row + half * std::sin(angle), middle.col + half * std::cos(angle)};
  }
  return outline;
}

TEST(Outline, a_pixel_that_is_aligned_covers_itself) {
  std::vector<Overlap> overlaps;
  cut_outline(square({3.5, 5.5}, 1, 0), {8, 9}, overlaps);
  // Corners are rounded, so slivers of neighbours may appear.
  double own = 0;
  for (const Overlap& o : overlaps)
    if (o.row == 3 && o.col == 5) own = o.area;
  EXPECT_NEAR(own, 1, 1e-14);
  EXPECT_NEAR(total(overlaps), 1, 1e-14);
}

// A square that stands on its corner in the middle of a pixel of side 2: known triangles.
TEST(Outline, a_diamond_covers_four_pixels_alike) {
  std::vector<Overlap> overlaps;
  cut_outline(square({2, 2}, 1, 45), {4, 4}, overlaps);
  ASSERT_EQ(overlaps.size(), 4U);
  for (const Overlap& o : overlaps) EXPECT_NEAR(o.area, 0.25, 1e-14);
}

TEST(Outline, what_lies_outside_the_grid_is_left_out) {
  std::vector<Overlap> overlaps;
  cut_outline(square({0, 2}, 1, 0), {4, 4}, overlaps);
  EXPECT_NEAR(total(overlaps), 0.5, 1e-14);
  cut_outline(square({-5, 2}, 1, 0), {4, 4}, overlaps);
  EXPECT_EQ(total(overlaps), 0);
}

TEST(Outline, the_direction_of_the_corners_does_not_matter) {
  const Outline one = square({2.3, 1.7}, 1.4, 20), other{one[3], one[2], one[1], one[0]};
  EXPECT_NEAR(area_of(one), 1.96, 1e-14);
  EXPECT_NEAR(area_of(other), 1.96, 1e-14);
  std::vector<Overlap> a, b;
  cut_outline(one, {5, 5}, a);
  cut_outline(other, {5, 5}, b);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_NEAR(a[k].area, b[k].area, 1e-14);
}

// The oracle counts points of a fine lattice. A line of length L through cells of side h misjudges at most L
// / h of them, each h² large.
TEST(Outline, areas_are_those_of_a_fine_lattice) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2);
  for (int i = 0; i < 50; ++i) {
    Outline outline = square({3 + jitter(random), 3 + jitter(random)}, 2.2, 90 * jitter(random));
    for (Point& p : outline) p = {p.row + jitter(random), p.col + jitter(random)};
    std::vector<Overlap> overlaps;
    cut_outline(outline, {6, 6}, overlaps);
    EXPECT_NEAR(total(overlaps), area_of(outline), 1e-13);
    constexpr int kFine = 200;
    for (const Overlap& o : overlaps) {
      int inside = 0;
      for (int r = 0; r < kFine; ++r)
        for (int c = 0; c < kFine; ++c) {
          const double y = o.row + (r + 0.5) / kFine, x = o.col + (c + 0.5) / kFine;
          int left = 0;
          for (std::size_t k = 0; k < 4; ++k) {
            const Point &a = outline[k], &b = outline[(k + 1) % 4];
            left += (b.col - a.col) * (y - a.row) - (b.row - a.row) * (x - a.col) > 0 ? 1 : 0;
          }
          inside += left == 0 || left == 4 ? 1 : 0;
        }
      EXPECT_NEAR(o.area, inside / static_cast<double>(kFine * kFine), 6.0 / kFine);
    }
  }
}

}  // namespace

}  // namespace symrig::outline_test

namespace symrig::stored_image_test {

// Images that are kept for later, in memory and in scratch files.

namespace {

/// Another value in each place.
Image<float> numbered(Grid grid, int channels) {
  Image<float> image(grid, channels);
  for (std::size_t k = 0; k < image.values().size(); ++k) image.values()[k] = static_cast<float>(k);
  return image;
}

TEST(StoredImage, is_the_image_that_it_was_made_from) {
  const Image<float> image = numbered({300, 200}, 3);  // 720 kB: large enough for a scratch file
  for (const bool in_file : {false, true}) {
    std::optional<MemoryScope> scope;
    if (in_file) scope.emplace(MemoryBudget{1, 0, std::filesystem::temp_directory_path()});
    const StoredImage stored = image;
    EXPECT_EQ(MemoryScope::scratch_bytes() > 0, in_file);
    EXPECT_EQ(stored, image);
    EXPECT_EQ(stored.grid(), image.grid());
    EXPECT_EQ(stored.channels(), 3);
    EXPECT_EQ(stored.plane(2)[199], image.plane(2)[199]);
    EXPECT_EQ(stored.at(7, 5, 1), image.at(7, 5, 1));
    const Image<float> again = stored;
    EXPECT_EQ(again, image);
    StoredImage other = stored;
    EXPECT_EQ(other, stored);
    other.at(299, 199, 2) = -1;
    EXPECT_FALSE(other == stored);
    EXPECT_FALSE(other == image);
  }
}

// Equal values are another image on another grid.
TEST(StoredImage, differs_from_an_image_of_another_shape) {
  EXPECT_FALSE(StoredImage(Image<float>({2, 6})) == Image<float>({3, 4}));
  EXPECT_FALSE(StoredImage(Image<float>({2, 6})) == Image<float>({2, 3}, 2));
}

}  // namespace

}  // namespace symrig::stored_image_test
