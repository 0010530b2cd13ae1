// SPDX-License-Identifier: Apache-2.0
// A camera with a pixel for each cell, shifted a little.
#include "calibration/registration/unmixing.hpp"

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "synthetic_photographs.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::unmixing_test {
namespace {

constexpr Grid kGrid{14, 17};

/// pixels = A cells, written down once more: pixel (i, j) is a square at (i, j) + shift.
std::vector<float> mixed(const std::vector<float>& cells, Point shift) {
  std::vector<float> pixels(cells.size());
  std::vector<Overlap> parts;
  for (int row = 0; row < kGrid.rows; ++row)
    for (int col = 0; col < kGrid.cols; ++col) {
      const double top = row + shift.row, left = col + shift.col;
      const Outline square{Point{top, left}, {top, left + 1}, {top + 1, left + 1}, {top + 1, left}};
      cut_outline(square, kGrid, parts);
      double sum = 0;
      for (const Overlap& o : parts) sum += o.area * double{cells[o.row * kGrid.cols + o.col]};
      pixels[row * kGrid.cols + col] = static_cast<float>(sum);
    }
  return pixels;
}

// The card: 2e-5 of the largest value for a shift of 0.2 along both axes, and rounding of 32 bits.
TEST(Unmixing, solves_the_equations) {
  std::uint64_t counter = 5;
  for (const Point shift : {Point{0.02, -0.05}, {-0.12, 0.12}, {0, 0.1}, {0.2, 0.2}}) {
    std::vector<float> cells(kGrid.size());
    for (float& v : cells) v = static_cast<float>(1 + 0.3 * test::normal(counter));
    const std::vector<float> pixels = mixed(cells, shift);
    const std::vector<std::uint8_t> valid(cells.size(), 1);
    std::vector<float> found(cells.size());
    calibration::unmix(kGrid, shift, pixels, valid, found);
    for (std::size_t i = 0; i < cells.size(); ++i) EXPECT_NEAR(found[i], cells[i], 5e-5) << i;
  }
}

TEST(Unmixing, an_invalid_pixel_harms_its_neighbours_little) {
  const std::vector<float> cells(kGrid.size(), 0.5F);
  std::vector<float> pixels = mixed(cells, {0.05, 0.05});
  std::vector<std::uint8_t> valid(cells.size(), 1);
  constexpr std::size_t kDead = 5 * 17 + 8;
  valid[kDead] = 0;
  pixels[kDead] = 0;
  std::vector<float> found(cells.size());
  calibration::unmix(kGrid, {0.05, 0.05}, pixels, valid, found);
  for (std::size_t i = 0; i < cells.size(); ++i) EXPECT_NEAR(found[i], i == kDead ? 0 : 0.5, 1e-4) << i;
}

// White noise of unit variance, 238 cells: its variance is known to √(2 / 238) = 9 %, and three of that are
// 28 %.
TEST(Unmixing, states_its_noise) {
  std::uint64_t counter = 9;
  std::vector<float> pixels(kGrid.size()), found(kGrid.size());
  const std::vector<std::uint8_t> valid(pixels.size(), 1);
  for (float& v : pixels) v = static_cast<float>(test::normal(counter));
  calibration::unmix(kGrid, {0.1, -0.1}, pixels, valid, found);
  double sum = 0;
  for (const float v : found) sum += double{v} * double{v};
  EXPECT_NEAR(sum / static_cast<double>(found.size()) / calibration::unmixed_noise({0.1, -0.1}), 1, 0.28);
}

// The bar of the registration for a shift of 0.02: as many patterns as the aligned rig takes, and 1.3 times
// its indirect error.
TEST(SharedGrid, a_shifted_rig_captures_as_the_aligned_one) {
  const std::string scene = "sim:vgroove-textured?size=32x32";
  const auto captured = [](Probe& probe, const VirtualRig& rig, double& indirect) {
    const auto result = capture(probe, {});
    EXPECT_TRUE(result.ok());
    const auto errors = evaluate(
        result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return rig.truth().apply(p); });
    EXPECT_TRUE(errors.ok());
    indirect = errors->indirect;
    return result->patterns;
  };
  const auto aligned = open_virtual_rig(scene), shifted = open_virtual_rig(scene + "&misalign=0.02");
  ASSERT_TRUE(aligned.ok() && shifted.ok());
  const auto found = register_camera(**shifted);
  ASSERT_TRUE(found.ok()) << found.error().line();
  ASSERT_TRUE(found->shift.has_value());
  EXPECT_NEAR(found->shift->row, 0.02, 0.001);
  EXPECT_NEAR(found->shift->col, 0.02, 0.001);
  EXPECT_EQ(found->weighting(), Weighting::unmixed);
  EXPECT_NEAR(found->maps.front().look({10, 20}).row, 10.02, 0.001);
  auto weights = found->weights();
  ASSERT_TRUE(weights.ok());
  RegisteredProbe probe(**shifted, *std::move(weights));
  double best = 0, indirect = 0;
  const auto fewest = captured(**aligned, **aligned, best);
  const auto patterns = captured(probe, **shifted, indirect);
  EXPECT_LE(static_cast<double>(patterns), 1.1 * static_cast<double>(fewest));
  EXPECT_LE(indirect, 1.3 * best);
}

// A ghost of a camera with a pixel for each cell is found to a fifth of its share and half a cell, and
// subtracted: then the rig captures as one without it.
TEST(SharedGrid, a_ghost_is_subtracted) {
  const std::string scene = "sim:vgroove-textured?size=32x32";
  const auto clean = open_virtual_rig(scene),
             ghostly = open_virtual_rig(scene + "&misalign=0.02&ghost=0.02@4.3,-2.6");
  ASSERT_TRUE(clean.ok() && ghostly.ok());
  const auto found = register_camera(**ghostly);
  ASSERT_TRUE(found.ok()) << found.error().line();
  ASSERT_TRUE(found->ghost.found) << found->ghost.significance;
  EXPECT_NEAR(found->ghost.share, 0.02, 0.2 * 0.02);
  EXPECT_NEAR(found->ghost.place.row, 4.3, 0.5);
  EXPECT_NEAR(found->ghost.place.col, -2.6, 0.5);
  EXPECT_NEAR(found->shift->row, 0.02, 0.002);
  EXPECT_NEAR(found->shift->col, 0.02, 0.002);
  const auto indirect = [](Probe& probe, const VirtualRig& rig) {
    const auto result = capture(probe, {});
    EXPECT_TRUE(result.ok());
    const auto errors = evaluate(
        result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return rig.truth().apply(p); });
    EXPECT_TRUE(errors.ok());
    return errors->indirect;
  };
  auto weights = found->weights();
  ASSERT_TRUE(weights.ok());
  RegisteredProbe probe(**ghostly, *std::move(weights), found->error());
  EXPECT_LE(indirect(probe, **ghostly), 1.5 * indirect(**clean, **clean));
}

TEST(SharedGrid, there_is_no_ghost_without_one) {
  for (const char* scene : {"plane", "vgroove-white", "gummy", "occluder", "mirror"}) {
    const auto rig = open_virtual_rig(std::string("sim:") + scene + "?size=32x32&misalign=0.02");
    ASSERT_TRUE(rig.ok());
    const auto found = register_camera(**rig);
    ASSERT_TRUE(found.ok()) << found.error().line();
    EXPECT_FALSE(found->ghost.found) << scene << " " << found->ghost.significance;
  }
}

TEST(Unmixing, a_shift_that_is_too_large_or_no_number_is_refused) {
  const double nan = std::nan("");
  for (const Point shift : {Point{0.13, 0}, {0, -0.13}, {nan, 0}, {0, nan}}) {
    const auto weights = CellWeights::unmixing(kGrid, 1, shift);
    ASSERT_FALSE(weights.ok());
    EXPECT_EQ(weights.error().code, ErrorCode::limit);
  }
}

TEST(SharedGrid, a_rig_that_is_far_off_is_refused) {
  const auto rig = open_virtual_rig("sim:vgroove-textured?size=32x32&misalign=0.4");
  ASSERT_TRUE(rig.ok());
  const auto found = register_camera(**rig);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error().code, ErrorCode::limit);
  EXPECT_NE(found.error().line().find("0.4"), std::string::npos) << found.error().line();
}

}  // namespace
}  // namespace symrig::unmixing_test
