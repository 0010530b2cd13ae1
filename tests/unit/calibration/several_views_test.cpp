// SPDX-License-Identifier: Apache-2.0
// A rig of several views whose camera has pixels of its own: which view a pixel belongs to, and where it
// looks.
#include "calibration/registration/views.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::several_views_test {
namespace {

using calibration::inside_view;
using calibration::OwnViews;
using calibration::ViewByView;

std::unique_ptr<VirtualRig> rig_of(const std::string& uri) {
  auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << rig.error().line();
  return *std::move(rig);
}

/// rms error of the map at the corners of the pixels that look at a cell [cells].
double map_error(const VirtualRig& rig, const Registration& found) {
  const CornerMap exact = rig.exact_corners().front(), map = found.maps.front().corners();
  double square = 0;
  int count = 0;
  for (int row = 0; row < exact.grid().rows; ++row)
    for (int col = 0; col < exact.grid().cols; ++col) {
      const double y = exact.at(row, col, 0), x = exact.at(row, col, 1);
      if (y < 0 || x < 0 || y > found.cells.rows || x > found.cells.cols) continue;
      square += (std::pow(map.at(row, col, 0) - y, 2) + std::pow(map.at(row, col, 1) - x, 2)) / 2;
      ++count;
    }
  return std::sqrt(square / count);
}

const std::string kTurned = "&fine=4&camera=185x185&turn=1.5&zoom=0.6435&shift=7.3,-4.1&distortion=0.02";

/// Of the Gray code: a view lit whole, and each bit that changes inside its tile.
std::int64_t code_photographs(const Probe& rig) {
  const GrayCode code(rig.grid());
  const auto changes = [&](int pair, int begin, int size) {
    for (int k = begin + 1; k < begin + size; ++k)
      if (code.lit(pair, k) != code.lit(pair, begin)) return true;
    return false;
  };
  std::int64_t count = 0;
  for (int row = 0; row < rig.views().rows; ++row)
    for (int col = 0; col < rig.views().cols; ++col) {
      const Tile tile = rig.views().tile(rig.grid(), {row, col});
      ++count;
      for (int pair = 0; pair < code.pairs(); ++pair)
        count += pair < code.column_bits() ? changes(pair, tile.col, tile.grid.cols)
                                           : changes(pair, tile.row, tile.grid.rows);
    }
  return count;
}

class Views : public testing::TestWithParam<const char*> {};

// Each half of the edges gives the map to some thousandths of a cell. A pixel taken for that of another view
// is a tile off: 8 cells or more.
TEST_P(Views, share_one_map) {
  const auto rig = rig_of(GetParam() + kTurned);
  const auto found = register_camera(*rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  EXPECT_LT(map_error(*rig, *found), 0.008);
  EXPECT_LT(map_error(*rig, *found), 4 * found->error());
  // And 4 of the flood-lit scene, 2 of stripes, 16 for the gain ratio; 6 for a ghost, if a tile has 12 cells.
  const bool ghost_is_looked_for = rig->views().rows == 2;
  EXPECT_EQ(found->photographs, code_photographs(*rig) + (ghost_is_looked_for ? 28 : 22));
  EXPECT_FALSE(found->ghost.found) << found->ghost.significance;
  EXPECT_FALSE(found->blur.measured);
  const auto weights = found->weights();
  ASSERT_TRUE(weights.ok()) << weights.error().line();
  EXPECT_EQ(weights->valid_cells(), std::int64_t{32} * 32);
}
// 3 x 3 tiles of 10 or 11 cells do not begin at powers of two.
INSTANTIATE_TEST_SUITE_P(Scenes, Views, testing::Values("sim:views2?size=32x32", "sim:views3?size=32x32"));

// The bars are those of one view: a fifth of the share, and a camera pixel, which is 0.27 cells wide.
TEST(ManyViews, a_ghost_is_found) {
  const auto rig =
      rig_of("sim:views2?size=48x48&fine=4&camera=245x245&turn=1.5&zoom=0.7288&ghost=0.02@4.3,-2.6");
  const auto found = register_camera(*rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  ASSERT_TRUE(found->ghost.found) << found->ghost.significance;
  EXPECT_NEAR(found->ghost.share, 0.02, 0.2 * 0.02);
  EXPECT_NEAR(found->ghost.place.row, 4.3, 0.27);
  EXPECT_NEAR(found->ghost.place.col, -2.6, 0.27);
  EXPECT_LT(map_error(*rig, *found), 0.008);
}

// Photographs are blurred by √(σp² − σc²). With four points along the side of a cell, one view tells it to
// 0.025 cells (docs/research/registration.md, A blurred bench).
TEST(ManyViews, both_blurs_are_measured) {
  const auto rig =
      rig_of("sim:views2?size=48x48&fine=4&camera=245x245&turn=1.5&zoom=0.7288&defocus=0.15,0.3");
  const auto found = register_camera(*rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  ASSERT_TRUE(found->blur.measured);
  const double missing = std::sqrt(std::pow(found->blur.projector, 2) - std::pow(found->blur.camera, 2));
  EXPECT_NEAR(missing, std::sqrt(0.299 * 0.299 - 0.173 * 0.173), 0.025);
}

TEST(ManyViews, a_camera_on_its_side_is_found_too) {
  const auto rig = rig_of("sim:views2?size=32x32&fine=4&camera=185x185&turn=92&zoom=0.6435");
  const auto found = register_camera(*rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  EXPECT_LT(map_error(*rig, *found), 0.008);
}

// The photographs of a pattern by each view alone add up to that of the pattern.
TEST(ViewByView, adds_up_and_takes_few_photographs) {
  const auto rig = rig_of("sim:views2?size=16x16&noise=off");
  ViewByView lit(*rig);
  Pattern pattern(rig->grid());
  for (int row = 0; row < 16; ++row)
    for (int col = 0; col < 16; ++col) pattern.at(row, col) = row < 8 && col % 3 == 0 ? 1.F : 0.F;
  Pattern complement(rig->grid(), 1, 1.F);
  for (std::size_t i = 0; i < complement.values().size(); ++i) complement.values()[i] -= pattern.values()[i];
  for (const Pattern& one : {pattern, complement}) {
    const auto by_view = lit.measure(one);
    ASSERT_TRUE(by_view.ok()) << by_view.error().line();
    ASSERT_EQ(by_view->size(), 4U);
    const Image<float> whole = rig->ideal_photograph(one);
    for (std::size_t i = 0; i < whole.values().size(); ++i) {
      float sum = 0;
      for (const Radiance& view : *by_view) sum += view.mean.values()[i];
      EXPECT_NEAR(sum, whole.values()[i], 1e-5F);
    }
  }
  // Four whole views. The pattern lights two; its complement is what is left of them, and two whole ones.
  EXPECT_EQ(rig->cost().photographs, 4 + 2);
}

TEST(InsideView, tiles_do_not_overlap) {
  const Pattern white({10, 7}, 1, 1.F);
  std::vector<int> lit(70);
  for (std::size_t view = 0; view < 6; ++view) {
    const Pattern inside = inside_view(white, {2, 3}, view);
    for (std::size_t i = 0; i < lit.size(); ++i) lit[i] += inside.values()[i] > 0 ? 1 : 0;
  }
  EXPECT_TRUE(std::ranges::all_of(lit, [](int n) { return n == 1; }));
}

// A pixel that looks at two tiles belongs to neither.
TEST(OwnViews, a_pixel_across_a_border_is_left_out) {
  // 4 x 8 cells in two views side by side; pixels of half a cell, shifted by a quarter.
  CornerMap corners({9, 17}, 2);
  for (int row = 0; row <= 8; ++row)
    for (int col = 0; col <= 16; ++col)
      corners.at(row, col, 0) = 0.5 * row, corners.at(row, col, 1) = 0.5 * col + 0.25;
  const OwnViews own({4, 8}, {1, 2}, {&corners, 1}, 0);
  std::vector<Radiance> by_view;
  for (const float light : {1.F, 2.F})
    by_view.push_back({Image<float>({8, 16}, 1, light), Image<float>({8, 16}, 1, light),
                       Image<std::uint8_t>({8, 16}, 1, std::uint8_t{1})});
  const Radiance seen = own.compose(by_view);
  EXPECT_EQ(seen.mean.at(3, 6), 1);   // 3.25 to 3.75
  EXPECT_EQ(seen.valid.at(3, 7), 0);  // 3.75 to 4.25
  EXPECT_EQ(seen.mean.at(3, 7), 0);
  EXPECT_EQ(seen.mean.at(3, 8), 2);
  EXPECT_EQ(seen.valid.at(3, 15), 1);  // a quarter beyond the last cell
}

// Photographs that do not depend on the patterns agree on no map.
TEST(OwnViews, without_stripes_there_is_no_map) {
  const GrayCode code({16, 16});
  std::vector<Radiance> photographs(static_cast<std::size_t>(code.photographs()),
                                    {Image<float>({40, 40}, 1, 1.F), Image<float>({40, 40}, 1, 1e-6F),
                                     Image<std::uint8_t>({40, 40}, 1, std::uint8_t{1})});
  const std::vector<std::vector<Radiance>> by_view(4, photographs);
  const auto own = OwnViews::find(code, {2, 2}, by_view);
  ASSERT_FALSE(own.ok());
  EXPECT_EQ(own.error().code, ErrorCode::bad_value);
}

// Its own cell gets nearly all light of a lit cell, as in the ideal rig. By area, 4.5 % would cross each
// border.
TEST(ManyViews, direct_light_stays_in_its_cell) {
  const auto rig = rig_of("sim:views2?size=32x32&noise=off" + kTurned);
  const auto found = register_camera(*rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  const auto weights = found->weights();
  ASSERT_TRUE(weights.ok());
  RegisteredProbe probe(*rig, *weights);
  EXPECT_EQ(probe.views(), (ViewLayout{2, 2}));
  Pattern one(rig->grid());
  one.at(8, 8) = 1;
  const auto seen = probe.measure({&one, 1});
  ASSERT_TRUE(seen.ok());
  const Image<float> ideal = rig->truth().apply(one);
  const float own = ideal.at(8, 8);
  EXPECT_NEAR(seen->front().mean.at(8, 8), own, 0.15F * own);
  for (const int col : {6, 7, 9, 10})
    EXPECT_NEAR(seen->front().mean.at(8, col), ideal.at(8, col), 0.03F * own) << col;
}

}  // namespace
}  // namespace symrig::several_views_test
