// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/outline.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

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
