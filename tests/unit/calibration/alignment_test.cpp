// SPDX-License-Identifier: Apache-2.0
// How simulated benches sit, against their keys.
#include "symrig/calibration/alignment.hpp"

#include "calibration/camera_map/perspective_map.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::alignment_test {
namespace {

using calibration::PerspectiveMap;
using calibration::SeenCoordinate;

constexpr Grid kCells{64, 64}, kCamera{240, 320};

struct Bench {
  double turn, pixels, row, col, distortion;
};

/// The map of a bench, as the keys of a simulated rig describe it.
Look look_of(const Bench& b) {
  return [b](Point at) {
    const double y = at.row - 0.5 * kCamera.rows, x = at.col - 0.5 * kCamera.cols;
    const double half = 0.5 * std::hypot(kCamera.rows, kCamera.cols), angle = b.turn * std::numbers::pi / 180;
    const double scale = (1 + b.distortion * (y * y + x * x) / (half * half)) / b.pixels;
    return Point{0.5 * kCells.rows + b.row + scale * (std::cos(angle) * y + std::sin(angle) * x),
                 0.5 * kCells.cols + b.col + scale * (std::cos(angle) * x - std::sin(angle) * y)};
  };
}

class Shape : public testing::TestWithParam<Bench> {};

// The prior counts 0.005 against 200 points and more, each of which moves by a tenth of h and more for a step
// of perspective or distortion: a part of 1e-4 of them, and of 32 cells less.
TEST_P(Shape, is_that_of_the_bench) {
  const Bench& b = GetParam();
  const MapShape shape = shape_of(kCamera, look_of(b), kCells);
  EXPECT_NEAR(shape.shift.row, b.row, 0.003);
  EXPECT_NEAR(shape.shift.col, b.col, 0.003);
  EXPECT_NEAR(shape.turn, b.turn, 0.003);
  EXPECT_NEAR(shape.pixels_per_cell, b.pixels, 1e-4 * b.pixels);
  EXPECT_NEAR(shape.distortion, b.distortion, 1e-4);
  EXPECT_NEAR(shape.keystone_rows, 0, 1e-4);
  EXPECT_NEAR(shape.keystone_cols, 0, 1e-4);
  EXPECT_FALSE(shape.mirrored);
  EXPECT_LE(shape.parallax.range, 0.003);
}

INSTANTIATE_TEST_SUITE_P(Benches, Shape,
                         testing::Values(Bench{0, 3.5, 0, 0, 0}, Bench{1.5, 3.5, 7.3, -4.1, 0.02},
                                         Bench{-37, 5, 1, 2, -0.05}, Bench{179, 3, -3, 0, 0.1},
                                         Bench{90, 2.5, 0, 9, 0}));

TEST(Shape, of_a_mirrored_picture_is_mirrored_back_first) {
  const Look straight = look_of({10, 3.5, 0, 0, 0});
  const Look mirrored = [&](Point at) { return straight({at.row, kCamera.cols - at.col}); };
  const MapShape shape = shape_of(kCamera, mirrored, kCells);
  EXPECT_TRUE(shape.mirrored);
  EXPECT_NEAR(shape.turn, 10, 0.003);
}

TEST(Shape, keystone_is_the_scale_of_one_side_over_the_other) {
  // Columns are farther apart on the right: the scale along rows and columns is 1 / (1 − 0.1 x).
  const Look look = [](Point at) {
    const double y = at.row - 120, x = at.col - 160, w = 1 - 0.1 * x / 160;
    return Point{32 + 0.2 * y / w, 32 + 0.2 * x / w};
  };
  const MapShape shape = shape_of(kCamera, look, kCells);
  // At 0.9 of the way to both sides, area goes with w⁻³, so the scale with w⁻³ᐟ².
  EXPECT_NEAR(shape.keystone_cols, std::pow(1.09 / 0.91, 1.5) - 1, 0.002);
  EXPECT_NEAR(shape.keystone_rows, 0, 0.002);
}

TEST(Shape, parallax_has_one_direction) {
  const Look flat = look_of({0, 3.5, 0, 0, 0});
  const Look deep = [&](Point at) {
    const Point to = flat(at);
    // Steps of depth across the direction: nothing that a perspective map could follow.
    const double depth = std::fmod(to.row + 100, 16.0) < 8 ? 0.5 : -0.5;
    return Point{to.row + 0.3 * depth, to.col + 0.4 * depth};
  };
  const Parallax found = shape_of(kCamera, deep, kCells).parallax;
  // √(0.3² + 0.4²); what the perspective map takes of it is less than the tenth that eight steps leave.
  EXPECT_NEAR(found.range, 0.5, 0.05);
  EXPECT_NEAR(found.direction.row, 0.6, 0.05);
  EXPECT_NEAR(found.direction.col, 0.8, 0.05);
  EXPECT_LT(found.across, 0.1 * found.along);
}

TEST(PerspectiveMap, coordinates_of_one_axis_at_a_few_borders_are_enough) {
  const Look look = look_of({5, 3.5, 2, -1, 0});
  std::vector<SeenCoordinate> seen;
  for (int row = 0; row < kCamera.rows; ++row)
    for (int col = 0; col < kCamera.cols; ++col) {
      const Point at{row + 0.5, col + 0.5}, to = look(at);
      for (const double border : {24.0, 40.0}) {
        if (std::abs(to.row - border) < 0.15) seen.push_back({at, StripeAxis::rows, to.row});
        if (std::abs(to.col - border) < 0.15) seen.push_back({at, StripeAxis::columns, to.col});
      }
    }
  PerspectiveMap map(kCamera);
  map.fit(seen);
  for (const Point at : {Point{0, 0}, Point{120, 160}, Point{240, 320}}) {
    EXPECT_NEAR(map.look(at).row, look(at).row, 0.01);
    EXPECT_NEAR(map.look(at).col, look(at).col, 0.01);
  }
}

Alignment aligned(const std::string& uri) {
  const auto rig = open_virtual_rig("sim:" + uri);
  EXPECT_TRUE(rig.ok()) << rig.error().line();
  auto found = measure_alignment(**rig);
  EXPECT_TRUE(found.ok()) << found.error().line();
  return *std::move(found);
}

struct Case {
  const char* name;
  const char* scene;
  const char* keys;
  Bench bench;
};

class FoundAlignment : public testing::TestWithParam<Case> {};

// An edge is right to a tenth of a pixel, so no mean of edges is worse: 0.1 pixels for the shift, and twice
// that at opposite sides of the cells for turn and scale.
TEST_P(FoundAlignment, is_that_of_the_bench) {
  const Case& c = GetParam();
  const Alignment a = aligned(std::string(c.scene) + "?size=48x48&fine=4&camera=192x240" + c.keys);
  ASSERT_TRUE(a.seen);
  const double tenth = 0.1 / c.bench.pixels, side = 24;
  EXPECT_NEAR(a.shape.shift.row, c.bench.row, tenth);
  EXPECT_NEAR(a.shape.shift.col, c.bench.col, tenth);
  EXPECT_NEAR(a.shape.turn, c.bench.turn, 2 * tenth / side * 180 / std::numbers::pi);
  EXPECT_NEAR(a.shape.pixels_per_cell, c.bench.pixels, 2 * tenth / side * c.bench.pixels);
  EXPECT_EQ(a.photographs, 8);
  EXPECT_TRUE(a.own_pixels());
}

// Zoom 1 shows the cells as large as the picture allows: 192 rows for 48 cells, 4 pixels each.
INSTANTIATE_TEST_SUITE_P(
    Benches, FoundAlignment,
    testing::Values(Case{"Straight", "plane", "", {0, 4, 0, 0, 0}},
                    Case{"Groove",
                         "vgroove-textured",
                         "&turn=1.5&zoom=0.8&shift=2.3,-4.1&distortion=0.02",
                         {1.5, 3.2, 2.3, -4.1, 0.02}},
                    Case{"Turned", "occluder", "&turn=30&zoom=0.7", {30, 2.8, 0, 0, 0}},
                    Case{"UpsideDown", "vgroove-white", "&turn=178&zoom=0.8", {178, 3.2, 0, 0, 0}},
                    Case{"OnItsSide", "plane", "&turn=-90", {-90, 4, 0, 0, 0}},
                    Case{"Beside", "plane", "&shift=20,-12", {0, 4, 20, -12, 0}},
                    Case{"Mirrors", "mirror", "&turn=2&zoom=0.8", {2, 3.2, 0, 0, 0}},
                    Case{"Scattering", "gummy", "&turn=2&zoom=0.8", {2, 3.2, 0, 0, 0}}),
    [](const auto& one) { return one.param.name; });

TEST(Alignment, says_which_cells_are_seen) {
  EXPECT_EQ(aligned("plane?size=48x48&fine=4&camera=192x240&zoom=0.9").cells_seen, 1);
  // The picture shows 48 rows from 20 on, and 60 columns from −18 on: 28 rows and 42 columns of the cells.
  const Alignment beside = aligned("plane?size=48x48&fine=4&camera=192x240&shift=20,-12");
  EXPECT_NEAR(beside.cells_seen, 28.0 * 42 / (48 * 48), 1.0 / 28 + 1.0 / 42);
}

TEST(Alignment, a_camera_that_sees_a_corner_says_where_it_looks) {
  const Alignment corner = aligned("plane?size=48x48&fine=4&camera=192x192&shift=-43,40");
  EXPECT_FALSE(corner.seen);
  ASSERT_TRUE(corner.glimpse.has_value());
  EXPECT_LT(corner.glimpse->row, -10);
  EXPECT_GT(corner.glimpse->col, 10);
  const Alignment nothing = aligned("plane?size=48x48&fine=4&camera=192x192&shift=100,0");
  EXPECT_FALSE(nothing.seen);
  EXPECT_FALSE(nothing.glimpse.has_value());
  const auto findings = judge(nothing);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_FALSE(all_good(findings));
}

// The blurs of both optics add in squares. A tenth of a pixel that an edge is off, and steps of 0.02 cells.
TEST(Alignment, finds_the_blur_of_both_optics) {
  for (const double blur : {0.2, 0.4}) {
    const Alignment a =
        aligned("vgroove-textured?size=48x48&fine=8&camera=192x240&turn=1.5&zoom=0.9&defocus=" +
                std::to_string(blur) + "," + std::to_string(blur));
    for (const TileFocus& tile : a.focus) {
      if (!tile.known) continue;
      EXPECT_NEAR(tile.blur, std::numbers::sqrt2 * blur, 0.05) << blur;
    }
    EXPECT_FALSE(all_good(judge(a)));
  }
  EXPECT_LE(aligned("vgroove-textured?size=48x48&fine=8&camera=192x240&turn=1.5&zoom=0.9").blur(), 0.1);
}

TEST(Alignment, finds_parallax_and_its_direction) {
  const Alignment deep = aligned("vgroove-textured?size=48x48&fine=4&camera=192x240&zoom=0.9&parallax=3");
  EXPECT_GT(std::abs(deep.shape.parallax.direction.col), 0.9);
  EXPECT_GT(deep.shape.parallax.range, 0.5);
  EXPECT_LE(deep.shape.parallax.range, 3);
  const Alignment flat = aligned("plane?size=48x48&fine=4&camera=192x240&zoom=0.9&turn=1");
  EXPECT_LE(flat.shape.parallax.range, 4 * 0.1 / 3.6);
}

TEST(Alignment, a_camera_with_a_pixel_for_each_cell_is_measured_by_the_axis_check) {
  const Alignment good = aligned("vgroove-textured?size=48x48&misalign=0.05");
  EXPECT_FALSE(good.own_pixels());
  EXPECT_NEAR(good.shape.shift.row, 0.05, 0.01);
  EXPECT_NEAR(good.shape.shift.col, 0.05, 0.01);
  EXPECT_TRUE(all_good(judge(good)));
  const Alignment bad = aligned("vgroove-textured?size=48x48&misalign=0.5");
  EXPECT_NEAR(bad.offset, 0.5, 0.1);
  EXPECT_FALSE(all_good(judge(bad)));
}

TEST(Alignment, goals_say_which_cells_would_do) {
  Alignment a;
  a.cells = {64, 64};
  a.camera = {300, 300};
  a.seen = true;
  a.cells_seen = 1;
  a.signal_to_noise = 100;
  a.shape.pixels_per_cell = 1.1;
  a.shape.parallax.range = 0.15;
  a.focus[4] = {true, 0.05};
  const AlignmentGoals goals{.least_pixels = 2.2, .blur = 0.1, .parallax = 0.3};
  auto findings = judge(a, goals);
  EXPECT_FALSE(all_good(findings));
  EXPECT_DOUBLE_EQ(cell_factor(findings), 2);
  a.shape.pixels_per_cell = 4.4;
  findings = judge(a, goals);
  EXPECT_TRUE(all_good(findings));
  EXPECT_DOUBLE_EQ(cell_factor(findings), 0.5);
  a.saturated = 0.01;
  EXPECT_FALSE(all_good(judge(a, goals)));
}

TEST(Alignment, counts_pixels_that_are_too_bright) {
  const Grid cells{48, 48};
  const auto patterns = alignment_patterns(cells);
  ASSERT_TRUE(patterns.ok());
  // A camera with 4 × 4 pixels for each cell; a tenth of its rows is saturated in white light.
  std::vector<Radiance> photographs;
  for (std::size_t k = 0; k < patterns->size(); ++k) {
    Radiance one{Image<float>({192, 192}, 1), Image<float>({192, 192}, 1, 1e-8F),
                 Image<std::uint8_t>({192, 192}, 1, std::uint8_t{1})};
    for (int row = 0; row < 192; ++row)
      for (int col = 0; col < 192; ++col) {
        const float light = (*patterns)[k].at(row / 4, col / 4);
        const bool bright = row >= 80 && row < 99 && light > 0;
        one.mean.at(row, col) = bright ? 0 : light;
        one.valid.at(row, col) = bright ? 0 : 1;
      }
    photographs.push_back(std::move(one));
  }
  const auto found = find_alignment(cells, photographs);
  ASSERT_TRUE(found.ok()) << found.error().line();
  ASSERT_TRUE(found->seen);
  EXPECT_NEAR(found->saturated, 19.0 / 192, 1.0 / 192);
  photographs.pop_back();
  EXPECT_EQ(find_alignment(cells, photographs).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(alignment_patterns({11, 64}).error().code, ErrorCode::limit);
}

// A point is lit from all views, so stripes would give any map.
TEST(Alignment, refuses_several_views) {
  const auto rig = open_virtual_rig("sim:views2?size=32x32&fine=2&camera=128x128");
  ASSERT_TRUE(rig.ok());
  const auto refused = measure_alignment(**rig);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_argument);
  EXPECT_NE(refused.error().line().find("4 views"), std::string::npos) << refused.error().line();
}

}  // namespace
}  // namespace symrig::alignment_test
