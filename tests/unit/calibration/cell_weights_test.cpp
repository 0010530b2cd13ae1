// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/cell_weights.hpp"

#include "cell_views.hpp"
#include "synthetic_photographs.hpp"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::cell_weights_test {
namespace {

using test::corners_of;
using test::normal;
using test::photograph;
using test::seen;
using test::weights_of;

constexpr Grid kCells{6, 8};

// Four pixels of 1/2 cell, sixteen of 1/4: every pixel counts, and the cell is their mean.
TEST(CellWeights, aligned_pixels_give_their_mean) {
  for (const auto weighting : {Weighting::area, Weighting::cores})
    for (const int per_cell : {2, 4}) {
      const Grid camera{kCells.rows * per_cell, kCells.cols * per_cell};
      const CornerMap corners = corners_of(camera, per_cell, 0, {});
      std::uint64_t counter = 1;
      Radiance some = photograph(camera, 1, 0);
      for (float& v : some.mean.values()) v = static_cast<float>(normal(counter));
      const CellWeights weights = weights_of(kCells, corners, photograph(camera, 1, 0.5F), {weighting, 0});
      const auto cells = weights.gather(some);
      ASSERT_TRUE(cells.ok());
      for (int row = 0; row < kCells.rows; ++row)
        for (int col = 0; col < kCells.cols; ++col) {
          double sum = 0;
          for (int i = 0; i < per_cell * per_cell; ++i)
            sum += static_cast<double>(
                some.mean.at(row * per_cell + i / per_cell, col * per_cell + i % per_cell));
          EXPECT_NEAR(cells->mean.at(row, col), sum / (per_cell * per_cell), 1e-6);
          EXPECT_NEAR(cells->variance.at(row, col), 1e-4 / (per_cell * per_cell), 1e-8);
        }
      EXPECT_NEAR(weights.noise_share(), 1.0 / (per_cell * per_cell), 1e-6);
      EXPECT_EQ(weights.valid_cells(), kCells.size());
      EXPECT_EQ(weights.cells_without_core(), 0);
    }
}

// A turned camera sees a surface whose albedo is anything, but constant inside a pixel, under light that is a
// plane. The ratio to the flood-lit photograph is that plane, so the core finds the mean of albedo · light
// over the cell exactly. Rounding of 32 bits.
TEST(CellWeights, a_plane_of_light_on_any_albedo_is_exact) {
  const Grid camera{40, 50};
  const CornerMap corners = corners_of(camera, 5, 10, {-1, -0.7});
  std::uint64_t counter = 2;
  Radiance flood = photograph(camera, 1, 0);
  for (float& v : flood.mean.values()) v = static_cast<float>(0.5 + 0.1 * normal(counter));
  const auto plane = [](Point p) { return 0.3 + 0.05 * p.row - 0.04 * p.col; };
  Radiance lit = seen(corners, plane);
  Image<double> light(kCells), area(kCells);
  std::vector<Overlap> overlaps;
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col) {
      lit.mean.at(row, col) *= flood.mean.at(row, col);
      cut_outline(outline_of(corners, row, col), kCells, overlaps);
      for (const Overlap& o : overlaps) {
        light.at(o.row, o.col) += o.area * static_cast<double>(flood.mean.at(row, col)) * plane(o.middle);
        area.at(o.row, o.col) += o.area;
      }
    }
  const auto cells = weights_of(kCells, corners, flood, {Weighting::cores, 0.03}).gather(lit);
  ASSERT_TRUE(cells.ok());
  int compared = 0;
  for (int row = 0; row < kCells.rows; ++row)
    for (int col = 0; col < kCells.cols; ++col) {
      if (!cells->valid.at(row, col)) continue;
      EXPECT_NEAR(cells->mean.at(row, col), light.at(row, col) / area.at(row, col), 2e-6);
      ++compared;
    }
  EXPECT_GT(compared, kCells.size() / 2);
}

// Each cell has an albedo of its own. Shares tell what a pixel on a border sees of each, so the flood-lit
// cells have exactly their albedo, also at the outer border of the grid. Without shares, the neighbours mix.
TEST(CellWeights, shares_separate_the_cells_of_a_pixel) {
  const Grid camera{40, 50};
  const CornerMap corners = corners_of(camera, 5, 0, {-1.03, -0.7});
  const auto albedo = [](int row, int col) { return 0.2 + 0.1 * ((3 * row + 5 * col) % 7); };
  Radiance flood = photograph(camera, 1, 0);
  Image<float> shares(camera, 2, 1.F);
  std::vector<Overlap> overlaps;
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col) {
      const Outline outline = outline_of(corners, row, col);
      cut_outline(outline, kCells, overlaps);
      double all = 0, first_row = 0, first_col = 0;
      for (const Overlap& o : overlaps) {
        const double light = o.area / area_of(outline) * albedo(o.row, o.col);
        all += light;
        first_row += o.row == overlaps.front().row ? light : 0;
        first_col += o.col == overlaps.front().col ? light : 0;
      }
      flood.mean.at(row, col) = static_cast<float>(all);
      if (all == 0) continue;
      shares.at(row, col, 0) = static_cast<float>(first_row / all);
      shares.at(row, col, 1) = static_cast<float>(first_col / all);
    }
  const auto with = CellWeights::make(kCells, {&corners, 1}, flood, {}, &shares);
  ASSERT_TRUE(with.ok()) << with.error().line();
  const auto by_share = with->gather(flood), by_area = weights_of(kCells, corners, flood).gather(flood);
  ASSERT_TRUE(by_share.ok() && by_area.ok());
  double worst = 0, worst_by_area = 0;
  for (int row = 1; row < kCells.rows; ++row)
    for (int col = 1; col < kCells.cols - 1; ++col) {
      worst = std::max(worst, std::abs(double{by_share->mean.at(row, col)} - albedo(row, col)));
      worst_by_area =
          std::max(worst_by_area, std::abs(double{by_area->mean.at(row, col)} - albedo(row, col)));
    }
  // The light of a pixel on a corner of cells with albedos a, b, c, d is not quite the product of its shares.
  // The difference is f (1 − f) g (1 − g) (a d − b c) / mean, with f = 0.15 and g = 0.5 here: at most 0.04 of
  // the light of a pixel, which is 1/25 of a cell, at each of four corners.
  EXPECT_LT(worst, 4 * 0.04 / 25);
  EXPECT_GT(worst_by_area, 0.01);
}

TEST(CellWeights, shares_that_cannot_be_are_refused) {
  const Grid camera{40, 50};
  const CornerMap corners = corners_of(camera, 5, 0, {});
  const Radiance flood = photograph(camera, 1, 1);
  for (const Image<float>& wrong : {Image<float>(camera, 2, 1.5F), Image<float>(camera, 2, std::nanf("")),
                                    Image<float>(camera, 1, 1.F), Image<float>({40, 49}, 2, 1.F)})
    EXPECT_FALSE(CellWeights::make(kCells, {&corners, 1}, flood, {}, &wrong).ok());
  const Image<float> unknown(camera, 2, kUnknownShare);
  EXPECT_TRUE(CellWeights::make(kCells, {&corners, 1}, flood, {}, &unknown).ok());
}

// One cell is lit, nothing else: cores do not see it from next door, area weights do.
TEST(CellWeights, cores_keep_direct_light_in_its_cell) {
  const Grid camera{40, 50};
  const CornerMap corners = corners_of(camera, 5, 10, {-1, -0.7});
  Radiance lit = photograph(camera, 1, 0);
  std::vector<Overlap> overlaps;
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col) {
      cut_outline(outline_of(corners, row, col), kCells, overlaps);
      for (const Overlap& o : overlaps)
        if (o.row == 3 && o.col == 4) lit.mean.at(row, col) = static_cast<float>(25 * o.area);
    }
  const Radiance flood = photograph(camera, 1, 1);
  const auto core = weights_of(kCells, corners, flood).gather(lit),
             area = weights_of(kCells, corners, flood, {Weighting::area}).gather(lit);
  ASSERT_TRUE(core.ok() && area.ok());
  EXPECT_NEAR(core->mean.at(3, 4), 1, 1e-5);
  EXPECT_LT(area->mean.at(3, 4), 0.9);
  EXPECT_NEAR(core->mean.at(3, 5), 0,
              1e-9);  // rounding of the excess, a few 1e-8, mostly stays with the lit cell
  EXPECT_GT(area->mean.at(3, 5), 0.02);
}

// A black cell next to bright ones: its flood-lit light is noise, which no ratio may be taken of.
TEST(CellWeights, a_black_cell_does_not_amplify_noise) {
  const Grid camera{40, 50};
  const CornerMap corners = corners_of(camera, 5, 10, {-1, -0.7});
  std::uint64_t seed = 5;
  const auto with_noise = [&](float light) {
    Radiance out = photograph(camera, 1, 0);
    std::vector<Overlap> overlaps;
    for (int row = 0; row < camera.rows; ++row)
      for (int col = 0; col < camera.cols; ++col) {
        cut_outline(outline_of(corners, row, col), kCells, overlaps);
        double black = 0;
        for (const Overlap& o : overlaps) black += o.row == 3 && o.col == 4 ? 25 * o.area : 0;
        out.mean.at(row, col) =
            light * static_cast<float>(1 - black) + static_cast<float>(1e-4 * normal(seed));
        out.variance.at(row, col) = 1e-8F;
      }
    return out;
  };
  const CellWeights weights = weights_of(kCells, corners, with_noise(1));
  EXPECT_LT(weights.noise_share(), 0.2);
  const auto cells = weights.gather(with_noise(0.5F));
  ASSERT_TRUE(cells.ok());
  ASSERT_TRUE(cells->valid.at(3, 4));
  // Shares by area: half of each pixel on its border is taken for its light.
  EXPECT_LT(cells->mean.at(3, 4), 0.25);
  EXPECT_LT(cells->variance.at(3, 4), 0.1);
  for (const auto& [row, col] : {std::pair(2, 4), std::pair(4, 4), std::pair(3, 3), std::pair(3, 5)})
    EXPECT_NEAR(cells->mean.at(row, col), 0.5, 0.1) << row << ", " << col;
}

TEST(CellWeights, invalid_pixels_are_left_out) {
  const Grid camera{24, 32};
  const CornerMap corners = corners_of(camera, 4, 0, {});
  Radiance lit = photograph(camera, 1, 0.25F);
  lit.valid.at(5, 5) = 0, lit.mean.at(5, 5) = 100;
  for (int i = 0; i < 16; ++i) lit.valid.at(8 + i / 4, 8 + i % 4) = 0;
  const auto cells = weights_of(kCells, corners, photograph(camera, 1, 1), {Weighting::cores, 0}).gather(lit);
  ASSERT_TRUE(cells.ok());
  EXPECT_NEAR(cells->mean.at(1, 1), 0.25, 1e-6);
  // The missing sixteenth may have 0.25 to 1 of its flood-lit light.
  EXPECT_NEAR(cells->variance.at(1, 1), 1e-4 / 15 + 0.75 * 0.75 / 3 / 16 / 16, 1e-9);
  EXPECT_EQ(cells->valid.at(1, 1), 1);
  EXPECT_EQ(cells->valid.at(2, 2), 0);
  EXPECT_EQ(cells->mean.at(2, 2), 0);
}

// A highlight is clipped in one photograph: it is as bright as the others of its cell are, each by its
// flood-lit light. If these differ, the cell is less certain.
TEST(CellWeights, clipped_highlights_are_told_by_the_rest_of_the_cell) {
  const Grid camera{24, 32};
  const CornerMap corners = corners_of(camera, 4, 0, {});
  Radiance flood = photograph(camera, 1, 1);
  flood.mean.at(5, 6) = 20;
  for (const auto weighting : {Weighting::area, Weighting::cores}) {
    const CellWeights weights = weights_of(kCells, corners, flood, {weighting, 0});
    Radiance lit = photograph(camera, 1, 0.25F);
    lit.mean.at(5, 6) = 5;
    const Radiance whole = *weights.gather(lit);
    EXPECT_NEAR(whole.mean.at(1, 1), 0.25 * 35 / 16, 1e-6);
    lit.valid.at(5, 6) = 0;
    const Radiance even = *weights.gather(lit);
    EXPECT_NEAR(even.mean.at(1, 1), whole.mean.at(1, 1), 1e-6);
    // 15 pixels with a light of 15 stand for 35.
    EXPECT_NEAR(even.variance.at(1, 1),
                whole.variance.at(1, 1) * 15 / 16 * 35 * 35 / 15 / 15 + 0.75 * 0.75 / 3 * 20 * 20 / 16 / 16,
                1e-6);
    // Half of the cell is dark, and the highlight is not.
    for (int row = 4; row < 8; ++row) lit.mean.at(row, 4) = lit.mean.at(row, 7) = 0;
    const Radiance half = *weights.gather(lit);
    lit.valid.at(5, 6) = 1;
    const double error = half.mean.at(1, 1) - weights.gather(lit)->mean.at(1, 1);
    EXPECT_GT(std::abs(error), 0.1 * half.mean.at(1, 1));
    EXPECT_LE(std::abs(error), 2 * std::sqrt(half.variance.at(1, 1)));
    EXPECT_EQ(half.variance.at(3, 3), whole.variance.at(3, 3));
  }
}

// Pixels that are dead in the flood-lit photograph never count.
TEST(CellWeights, dead_pixels_of_the_flood_lit_photograph_do_not_count) {
  const Grid camera{24, 32};
  const CornerMap corners = corners_of(camera, 4, 0, {});
  Radiance flood = photograph(camera, 1, 1), lit = photograph(camera, 1, 0.25F);
  flood.valid.at(5, 6) = 0, flood.mean.at(5, 6) = 0;
  lit.mean.at(5, 6) = 7;
  for (const auto weighting : {Weighting::area, Weighting::cores}) {
    lit.valid.at(5, 6) = weighting == Weighting::area ? 0 : 1;  // area weights know no flood-lit photograph
    const auto cells = weights_of(kCells, corners, flood, {weighting, 0}).gather(lit);
    ASSERT_TRUE(cells.ok());
    EXPECT_NEAR(cells->mean.at(1, 1), 0.25, 1e-6);
  }
}

TEST(CellWeights, cells_that_the_camera_does_not_see_are_not_valid) {
  const Grid camera{24, 32};
  const CornerMap corners = corners_of(camera, 4, 0, {3, 0.6});  // rows 3 to 9, columns 0.6 to 8.6
  const CellWeights weights = weights_of(kCells, corners, photograph(camera, 1, 1));
  const auto cells = weights.gather(photograph(camera, 1, 1));
  ASSERT_TRUE(cells.ok());
  EXPECT_EQ(cells->valid.at(2, 4), 0);
  EXPECT_EQ(cells->valid.at(3, 4), 1);
  EXPECT_EQ(cells->valid.at(4, 0), 0);  // 0.4 of it is seen
  EXPECT_EQ(cells->valid.at(4, 1), 1);
  EXPECT_EQ(weights.valid_cells(), 3 * 7);
}

TEST(CellWeights, a_coarse_camera_falls_back_to_area) {
  const Grid camera{12, 16};
  const CornerMap corners = corners_of(camera, 1.5, 3, {-0.4, -0.3});
  const CellWeights weights = weights_of(kCells, corners, photograph(camera, 1, 1));
  EXPECT_GT(weights.cells_without_core(), 0);
  const auto cells = weights.gather(photograph(camera, 1, 0.5F));
  ASSERT_TRUE(cells.ok());
  for (std::size_t i = 0; i < cells->mean.values().size(); ++i)
    EXPECT_NEAR(cells->mean.values()[i], cells->valid.values()[i] ? 0.5 : 0, 1e-6);
}

TEST(CellWeights, each_channel_has_its_map) {
  const Grid camera{24, 32};
  const std::vector<CornerMap> corners{corners_of(camera, 4, 0, {}), corners_of(camera, 4, 0, {}),
                                       corners_of(camera, 4, 0, {0, 1})};
  Radiance lit = photograph(camera, 3, 0);
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < 16; ++i) lit.mean.at(8 + i / 4, 8 + i % 4, c) = 1;
  const auto weights = CellWeights::make(kCells, corners, photograph(camera, 3, 1), {Weighting::cores, 0});
  ASSERT_TRUE(weights.ok());
  const auto cells = weights->gather(lit);
  ASSERT_TRUE(cells.ok());
  EXPECT_EQ(cells->mean.at(2, 2, 0), 1);
  EXPECT_EQ(cells->mean.at(2, 2, 1), 1);
  EXPECT_EQ(cells->mean.at(2, 2, 2), 0);
  EXPECT_EQ(cells->mean.at(2, 3, 2), 1);
}

TEST(CellWeights, refuses_sizes_that_differ) {
  const CornerMap corners = corners_of({24, 32}, 4, 0, {});
  EXPECT_EQ(CellWeights::make(kCells, {&corners, 1}, photograph({24, 31}, 1, 1)).error().code,
            ErrorCode::size_mismatch);
  const std::vector<CornerMap> two(2, corners);
  EXPECT_EQ(CellWeights::make(kCells, two, photograph({24, 32}, 3, 1)).error().code,
            ErrorCode::size_mismatch);
  CornerMap broken = corners;
  broken.at(3, 3, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(CellWeights::make(kCells, {&broken, 1}, photograph({24, 32}, 1, 1)).error().code,
            ErrorCode::bad_value);
  const CellWeights weights = weights_of(kCells, corners, photograph({24, 32}, 1, 1));
  EXPECT_EQ(weights.gather(photograph({24, 32}, 3, 1)).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(weights.gather(photograph({32, 24}, 1, 1)).error().code, ErrorCode::size_mismatch);
}

}  // namespace
}  // namespace symrig::cell_weights_test
