// SPDX-License-Identifier: Apache-2.0
// Pixels that see several cells: what the planes of the cells do not describe gets to the cells.
// A camera with a pixel for each cell, shifted a little.
#include "calibration/cells/neighbour_light.hpp"
#include "cell_views.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::shared_pixels_test {
namespace {

using test::normal;

constexpr Grid kCells{12, 14};
constexpr Grid kCamera{64, 72};

/// 4.3 pixels along the side of a cell, turned. The camera sees a part of the cells.
CornerMap corners() {
  return test::corners_of(kCamera, 4.3, 7, {-0.4, 0.6});
}

/// Cells whose neighbours are all seen whole, so that every pixel of theirs counts.
bool is_inside(int row, int col) {
  return row >= 2 && col >= 3 && row < 10 && col < 12;
}

/// A cell that is lit by an edge: dark on one side of a line, and as bright as this on the other.
struct Edge {
  double along, across, place;  ///< the line: along · row + across · col = place, from the middle of a cell
  double bright;
};

/// Light with an edge in each cell, as a mirror throws it. Its mean over each cell is the truth.
struct EdgyScene {
  std::vector<Edge> edges;

  explicit EdgyScene(std::uint64_t seed) {
    for (std::int64_t i = 0; i < kCells.size(); ++i) {
      const double angle = 3 * normal(seed);
      edges.push_back({std::cos(angle), std::sin(angle), 0.25 * normal(seed), 0.5 + 0.1 * normal(seed)});
    }
  }
  double operator()(Point p) const {
    const int row = static_cast<int>(std::floor(p.row)), col = static_cast<int>(std::floor(p.col));
    if (row < 0 || col < 0 || row >= kCells.rows || col >= kCells.cols) return 0;
    const Edge& e = edges[static_cast<std::size_t>(std::int64_t{row} * kCells.cols + col)];
    return e.along * (p.row - row - 0.5) + e.across * (p.col - col - 0.5) > e.place ? e.bright : 0.02;
  }
  /// Mean over a cell, by 40 x 40 points.
  double mean(int row, int col) const {
    double sum = 0;
    for (int i = 0; i < 40; ++i)
      for (int j = 0; j < 40; ++j) sum += (*this)({row + (i + 0.5) / 40, col + (j + 0.5) / 40});
    return sum / 1600;
  }
  /// What the camera sees: the mean over each pixel, by 8 x 8 points.
  Radiance photograph() const {
    const CornerMap map = corners();
    Radiance out = test::photograph(kCamera, 1, 0);
    for (int row = 0; row < kCamera.rows; ++row)
      for (int col = 0; col < kCamera.cols; ++col) {
        const Outline o = outline_of(map, row, col);
        double sum = 0;
        for (int i = 0; i < 8; ++i)
          for (int j = 0; j < 8; ++j) {
            const double u = (i + 0.5) / 8, v = (j + 0.5) / 8;
            sum += (*this)({o[0].row + u * (o[3].row - o[0].row) + v * (o[1].row - o[0].row),
                            o[0].col + u * (o[3].col - o[0].col) + v * (o[1].col - o[0].col)});
          }
        out.mean.at(row, col) = static_cast<float>(sum / 64);
        out.variance.at(row, col) = 1e-8F;
      }
    return out;
  }
};

// The planes cannot follow the edges, but no light is lost: the cells of a region have the light of its
// pixels, except where its border cuts pixels. And each cell is right to what it states.
TEST(SharedPixels, edges_inside_cells_are_measured_to_what_is_stated) {
  const CellWeights weights = test::weights_of(kCells, corners(), test::photograph(kCamera, 1, 1));
  double error = 0, stated = 0, total = 0, expected = 0, square = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const EdgyScene scene(seed);
    const auto cells = weights.gather(scene.photograph());
    ASSERT_TRUE(cells.ok());
    for (int row = 0; row < kCells.rows; ++row)
      for (int col = 0; col < kCells.cols; ++col) {
        if (!is_inside(row, col)) continue;
        const double truth = scene.mean(row, col),
                     off = static_cast<double>(cells->mean.at(row, col)) - truth;
        error += off * off, stated += static_cast<double>(cells->variance.at(row, col));
        total += off, expected += truth, square += truth * truth;
      }
  }
  // Core pixels alone err by 0.137 of the light of such cells.
  EXPECT_LT(std::sqrt(error / square), 0.09);
  EXPECT_LT(std::abs(total), 0.002 * expected);
  // The doubt takes pixels for independent. The 4.3 pixels along the side of a cell are not: their errors add
  // up to between the root of 4.3 and 4.3 times that of one.
  EXPECT_LT(error, 4.3 * 4.3 * stated);
  EXPECT_GT(error, stated);
}

struct Noisy {
  double light, sigma;
};
class NoisyCells : public testing::TestWithParam<Noisy> {};

// Each cell's mean is right to its noise, and its noise is the stated variance: for no light, for light below
// and above the noise. The excess follows the noise of the planes, so this would show where it is pulled.
TEST_P(NoisyCells, have_no_bias_and_their_stated_variance) {
  constexpr int kTimes = 300;
  const auto [light, sigma] = GetParam();
  const CellWeights weights = test::weights_of(kCells, corners(), test::photograph(kCamera, 1, 1));
  std::uint64_t seed = 7;
  double sum = 0, squares = 0, stated = 0, count = 0;
  for (int k = 0; k < kTimes; ++k) {
    Radiance noisy = test::photograph(kCamera, 1, 0);
    for (float& v : noisy.mean.values()) v = static_cast<float>(light + sigma * normal(seed));
    for (float& v : noisy.variance.values()) v = static_cast<float>(sigma * sigma);
    const auto cells = weights.gather(noisy);
    ASSERT_TRUE(cells.ok());
    for (int row = 0; row < kCells.rows; ++row)
      for (int col = 0; col < kCells.cols; ++col) {
        if (!is_inside(row, col)) continue;
        const double off = static_cast<double>(cells->mean.at(row, col)) - light;
        sum += off, squares += off * off, ++count;
        stated += static_cast<double>(cells->variance.at(row, col));
      }
  }
  // Neighbours share pixels, so a mean of n cells is less certain than 1 / sqrt(n): by at most sqrt(2).
  EXPECT_LT(std::abs(sum / count), 4 * std::sqrt(2 * squares / count / count));
  EXPECT_NEAR(std::sqrt(stated / squares), 1, 0.1);
}

INSTANTIATE_TEST_SUITE_P(SharedPixels, NoisyCells,
                         testing::Values(Noisy{0, 0.01}, Noisy{0.003, 0.01}, Noisy{0.01, 0.01},
                                         Noisy{0.03, 0.01}, Noisy{1, 0.01}));

// A core pixel that is missing makes its cell's plane as bright as the others do, so the border pixels are
// not taken for excess.
TEST(SharedPixels, a_missing_pixel_of_a_core_changes_nothing_in_even_light) {
  const CellWeights weights = test::weights_of(kCells, corners(), test::photograph(kCamera, 1, 1));
  Radiance even = test::photograph(kCamera, 1, 0.5F);
  for (int k = 0; k < 40; ++k) even.valid.at(20 + k / 7, 17 + 2 * (k % 7)) = 0;
  const auto cells = weights.gather(even);
  ASSERT_TRUE(cells.ok());
  for (int row = 0; row < kCells.rows; ++row)
    for (int col = 0; col < kCells.cols; ++col)
      if (cells->valid.at(row, col)) {
        EXPECT_NEAR(cells->mean.at(row, col), 0.5, 1e-5) << row << ", " << col;
      }
}

}  // namespace
}  // namespace symrig::shared_pixels_test

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
