// SPDX-License-Identifier: Apache-2.0
// The blur of camera and projector, and photographs that are blurred until both are equal.
// Combs show by reciprocity where a map is wrong.
#include "calibration/camera_optics/combs.hpp"
#include "calibration/cells/neighbour_light.hpp"
#include "symrig/calibration/camera_optics.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::optics_blur_test {
namespace {

constexpr const char* kBench = "&camera=152x152&turn=1.5&zoom=0.784&shift=3.3,-2.1&distortion=0.02";
/// rms width of a camera pixel, a box of 1/3.72 cells.
const double kPixel = 1 / (3.72 * std::sqrt(12));

struct Case {
  double camera, projector;
};

class FoundBlur : public testing::TestWithParam<Case> {};

// The scene's points are squares of a quarter of a cell. The camera sees their whole squares, which counts as
// a blur of 0.07 cells; the projector lights only whole ones, and loses as much.
TEST_P(FoundBlur, is_the_true_one) {
  const auto [camera, projector] = GetParam();
  const auto rig = open_virtual_rig("sim:plane?size=32x32&fine=4&defocus=" + std::to_string(camera) + "," +
                                    std::to_string(projector) + kBench);
  ASSERT_TRUE(rig.ok());
  const auto found = register_camera(**rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  ASSERT_TRUE(found->blur.measured);
  EXPECT_EQ(found->photographs, 22 + 6 + 2 + 8 + 16);
  EXPECT_EQ(found->weighting(), Weighting::area);
  const double true_camera = std::hypot(camera, kPixel);
  EXPECT_NEAR(found->blur.projector, projector, 0.03);
  EXPECT_NEAR(found->blur.camera, true_camera, 0.03);
  EXPECT_NEAR(found->blur.missing(0), std::max(0.0, projector * projector - true_camera * true_camera), 0.02);
  EXPECT_NEAR(found->edge_blur(), std::hypot(camera, projector), 0.1 * std::hypot(camera, projector));
}

INSTANTIATE_TEST_SUITE_P(Optics, FoundBlur,
                         testing::Values(Case{0.15, 0.3}, Case{0.3, 0.15}, Case{0.2, 0.2}));

// The texture near the borders tells the blurs apart, on any scene that has some. With eight points a cell,
// these count as 0.036 cells: the camera's blur is √(0.15² + 0.0775² + 0.036²) = 0.173.
TEST(FoundBlurs, are_told_apart_by_texture) {
  for (const char* scene : {"plane", "vgroove-textured", "vgroove-mixed"}) {
    const auto rig =
        open_virtual_rig(std::string("sim:") + scene + "?size=32x32&fine=8&defocus=0.15,0.3" + kBench);
    ASSERT_TRUE(rig.ok());
    const auto found = register_camera(**rig);
    ASSERT_TRUE(found.ok()) << found.error().line();
    EXPECT_NEAR(found->blur.camera, 0.173, 0.01) << scene;
    EXPECT_NEAR(found->blur.projector, 0.298, 0.01) << scene;
    EXPECT_LT(found->blur.sigma, 0.01) << scene;
  }
}

// Σ Q(t / σ) over 100,000 points of each half, for σ = 0.3.
TEST(OpticsBlur, far_light_is_that_of_a_gaussian) {
  double near = 0, far = 0;
  for (int i = 0; i < 100'000; ++i) {
    near += std::erfc((i + 0.5) * 0.5e-5 / 0.3 / std::sqrt(2));
    far += std::erfc((0.5 + (i + 0.5) * 0.5e-5) / 0.3 / std::sqrt(2));
  }
  EXPECT_NEAR(OpticsBlur::far_light(0.3), far / near, 1e-6);
  EXPECT_EQ(OpticsBlur::far_light(0), 0);
}

class Scattered : public testing::TestWithParam<double> {};

// Light that scatters below the surface is no blur of the optics, however many pixels a cell has: weighted by
// area, direct light would get into the next cell. A blur of the optics is one, on the same cameras.
TEST_P(Scattered, light_is_no_blur) {
  const int camera = static_cast<int>(std::lround(32 * GetParam() / 0.78));
  const std::string bench = "?size=32x32&fine=4&turn=1.5&zoom=0.78&shift=1.3,-1.1&distortion=0.02&camera=" +
                            std::to_string(camera) + "x" + std::to_string(camera);
  const auto weighting = [&](const std::string& uri) {
    const auto rig = open_virtual_rig(uri);
    EXPECT_TRUE(rig.ok());
    const auto found = register_camera(**rig);
    EXPECT_TRUE(found.ok()) << found.error().line();
    return found->weighting();
  };
  EXPECT_EQ(weighting("sim:gummy" + bench), Weighting::cores);
  EXPECT_EQ(weighting("sim:vgroove-textured" + bench + "&defocus=0.1,0.1"), Weighting::area);
  EXPECT_EQ(weighting("sim:vgroove-white" + bench + "&defocus=0,0.2"), Weighting::area);
}

INSTANTIATE_TEST_SUITE_P(Cameras, Scattered, testing::Values(2.25, 3.0, 4.0, 6.0));

TEST(OpticsBlur, a_sharp_picture_is_not_measured) {
  const auto rig = open_virtual_rig(std::string("sim:vgroove-textured?size=32x32&fine=4") + kBench);
  ASSERT_TRUE(rig.ok());
  const auto found = register_camera(**rig);
  ASSERT_TRUE(found.ok());
  EXPECT_FALSE(found->blur.measured);
  EXPECT_EQ(found->blur.missing(0), 0);
  EXPECT_EQ(found->weighting(), Weighting::cores);
}

// One bright pixel becomes a Gaussian: same light, and the variance asked for.
TEST(Blurred, has_the_width_that_was_asked_for) {
  for (const double width : {0.3, 0.61, 0.72, 1.0, 2.5}) {
    const Grid grid{41, 43};
    Radiance one{Image<float>(grid, 1), Image<float>(grid, 1, 0.25F),
                 Image<std::uint8_t>(grid, 1, std::uint8_t{1})};
    one.mean.at(20, 21) = 1;
    const Radiance out = calibration::blurred(one, width);
    double light = 0, row = 0, col = 0;
    for (int r = 0; r < grid.rows; ++r)
      for (int c = 0; c < grid.cols; ++c) {
        const double v = out.mean.at(r, c);
        light += v;
        row += v * (r - 20) * (r - 20);
        col += v * (c - 21) * (c - 21);
      }
    EXPECT_NEAR(light, 1, 1e-5);
    // Cut at 3.5 widths, a Gaussian has 0.6 % less variance.
    EXPECT_NEAR(row, width * width, 0.01 * width * width);
    EXPECT_NEAR(col, width * width, 0.01 * width * width);
    EXPECT_NEAR(out.variance.at(20, 21), 0.25, 1e-5);
  }
}

// Flood-lit photographs of a bench whose photographs are blurred scatter as they state. Each of 1,024 cells
// gives four differences, and neighbours share noise, so the mean of their squares is known to about 5 %. The
// rest is for pixels that differ in brightness, and for the edge of the grid.
TEST(Blurred, photographs_state_their_noise) {
  // On so few cells some draws of the noise leave open which side is blurred more. This one does not.
  const auto rig = open_virtual_rig(
      std::string("sim:vgroove-white?size=32x32&fine=4&defocus=0.1,0.3&exposures=4") + kBench);
  ASSERT_TRUE(rig.ok());
  const auto found = register_camera(**rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  ASSERT_GT(found->blur.missing(0), 0.02);
  const auto weights = found->weights();
  ASSERT_TRUE(weights.ok());
  const std::vector<Pattern> white(8, Pattern({32, 32}, 1, 1.F));
  const auto photographs = (*rig)->measure(white);
  ASSERT_TRUE(photographs.ok());
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < white.size(); k += 2) {
    const auto one = weights->gather((*photographs)[k]), other = weights->gather((*photographs)[k + 1]);
    ASSERT_TRUE(one.ok() && other.ok());
    for (std::size_t i = 0; i < one->mean.values().size(); ++i) {
      if (!one->valid.values()[i] || !other->valid.values()[i]) continue;
      sum += std::pow(double{one->mean.values()[i]} - double{other->mean.values()[i]}, 2) /
             (double{one->variance.values()[i]} + double{other->variance.values()[i]});
      count += 1;
    }
  }
  EXPECT_GT(sum / count, 0.8);
  EXPECT_LT(sum / count, 1.25);
}

TEST(Blurred, invalid_pixels_and_the_border_do_not_darken) {
  const Grid grid{9, 11};
  Radiance flat{Image<float>(grid, 2, 0.5F), Image<float>(grid, 2, 0.01F),
                Image<std::uint8_t>(grid, 2, std::uint8_t{1})};
  flat.mean.at(4, 5, 1) = 0;
  flat.variance.at(4, 5, 1) = 0;
  flat.valid.at(4, 5, 1) = 0;
  const Radiance out = calibration::blurred(flat, 1.2);
  for (int c = 0; c < 2; ++c)
    for (int r = 0; r < grid.rows; ++r)
      for (int q = 0; q < grid.cols; ++q) {
        const bool valid = c == 0 || r != 4 || q != 5;
        EXPECT_EQ(out.valid.at(r, q, c), valid ? 1 : 0);
        EXPECT_NEAR(out.mean.at(r, q, c), valid ? 0.5 : 0, 1e-6);
      }
}

}  // namespace
}  // namespace symrig::optics_blur_test

namespace symrig::reciprocal_shift_test {
namespace {

using calibration::ShiftField;

constexpr int kSide = 48;

std::string bench(const std::string& scene) {
  return "sim:" + scene +
         "?size=48x48&fine=4&defocus=0.15,0.3&camera=228x228&turn=1.5&zoom=0.784&shift=3.3,-2.1&distortion=0."
         "02";
}

/// A camera that looks up to 0.02 cells beside its map, over a quarter of the picture: [cells]
Point planted(Point cell) {
  const double turn = 2 * std::numbers::pi / kSide;
  return {0.02 * std::sin(turn * cell.row) * std::cos(turn * cell.col / 2), 0.02 * std::cos(turn * cell.col)};
}

struct Fields {
  ShiftField rows, columns;
};

/// What the combs show of the maps of a registration.
Fields fields_of(const Registration& registration, const CombPhotographs& combs) {
  const auto weights = registration.weights();
  EXPECT_TRUE(weights.ok());
  const auto rows = calibration::gathered(*weights, combs.rows),
             columns = calibration::gathered(*weights, combs.columns);
  EXPECT_TRUE(rows.ok() && columns.ok());
  const Image<std::uint8_t> seen({kSide, kSide}, 1, std::uint8_t{1});
  const std::vector<int> channel{0};
  return {ShiftField(*rows, seen, true, channel), ShiftField(*columns, seen, false, channel)};
}

// A second of 16 by 16 points of a picture, between the knots of the splines.
TEST(CameraMap, is_shifted_by_what_was_asked_for) {
  const auto rig = open_virtual_rig(bench("vgroove-textured"));
  ASSERT_TRUE(rig.ok());
  const auto found = register_camera(**rig, {.refine = false});
  ASSERT_TRUE(found.ok()) << found.error().line();
  const CameraMap& map = found->maps.front();
  const CameraMap moved = map.shifted(planted);
  for (int row = 0; row < 16; ++row)
    for (int col = 0; col < 16; ++col) {
      const Point at{(row + 0.37) * 228 / 16, (col + 0.61) * 228 / 16};
      const Point before = map.look(at), after = moved.look(at), more = planted(before);
      // A cubic spline with knots h apart errs by 5 h⁴ / 384 of the fourth derivative: 0.02 (2π / 48)⁴, h
      // = 2.6 cells.
      EXPECT_NEAR(after.row, before.row + more.row, 2e-5);
      EXPECT_NEAR(after.col, before.col + more.col, 2e-5);
    }
}

class PlantedShift : public testing::TestWithParam<const char*> {};

// The field is known to its noise and to a twentieth: one round counts the light that crosses a border as a
// cell's own, which is an eighth at this blur.
TEST_P(PlantedShift, is_found_and_corrected) {
  const auto rig = open_virtual_rig(bench(GetParam()));
  ASSERT_TRUE(rig.ok());
  auto found = register_camera(**rig, {.refine = false});
  ASSERT_TRUE(found.ok()) << found.error().line();
  ASSERT_TRUE(found->blur.measured);
  const auto combs = photograph_combs(**rig);
  ASSERT_TRUE(combs.ok());
  const Fields before = fields_of(*found, *combs);
  found->maps.front() = found->maps.front().shifted(planted);
  const Fields after = fields_of(*found, *combs);
  ASSERT_TRUE(after.rows.found() && after.columns.found());
  double wrong = 0, all = 0;
  for (int row = 4; row < kSide; row += 8)
    for (int col = 4; col < kSide; col += 8) {
      const Point at{row + 0.0, col + 0.0}, more = planted(at);
      // The camera looks where it did, so it looks beside the new map by the opposite.
      const Point seen{after.rows(at) - before.rows(at), after.columns(at) - before.columns(at)};
      wrong += std::pow(seen.row + more.row, 2) + std::pow(seen.col + more.col, 2);
      all += std::pow(more.row, 2) + std::pow(more.col, 2);
    }
  EXPECT_LT(std::sqrt(wrong / all), 0.25);
}

INSTANTIATE_TEST_SUITE_P(Scenes, PlantedShift, testing::Values("vgroove-textured", "occluder"));

/// Combs of a row of cells whose light crosses both borders alike, with noise. No map is wrong.
std::vector<Radiance> symmetric_combs(std::uint32_t seed) {
  const Grid grid{kSide, kSide};
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, 0.002F);
  std::uniform_real_distribution<float> albedo(0.3F, 1);
  std::vector<float> light(kSide);
  for (float& one : light) one = albedo(random);
  std::vector<Radiance> combs;
  for (int k = 0; k < CombPhotographs::period; ++k) {
    Radiance one{Image<float>(grid), Image<float>(grid, 1, 4e-6F),
                 Image<std::uint8_t>(grid, 1, std::uint8_t{1})};
    for (int row = 0; row < kSide; ++row)
      for (int col = 0; col < kSide; ++col)
        for (int lit = k; lit < kSide; lit += CombPhotographs::period) {
          const float share = lit == col ? 1.F : std::abs(lit - col) == 1 ? 0.1F : 0.F;
          one.mean.at(row, col) += share * std::sqrt(light[lit] * light[col]);
        }
    for (float& v : one.mean.values()) v += noise(random);
    combs.push_back(std::move(one));
  }
  return combs;
}

// Each of 60 draws exceeds two sigmas with a probability of 2.3 %. More than 6 of them do in one run of
// 3,000.
TEST(ShiftField, noise_is_no_shift) {
  const Image<std::uint8_t> seen({kSide, kSide}, 1, std::uint8_t{1});
  const std::vector<int> channel{0};
  int found = 0;
  for (std::uint32_t seed = 0; seed < 60; ++seed)
    found += ShiftField(symmetric_combs(seed), seen, false, channel).found() ? 1 : 0;
  EXPECT_LE(found, 6);
}

TEST(ShiftField, nothing_is_known_of_a_dark_scene) {
  const Image<std::uint8_t> seen({kSide, kSide}, 1, std::uint8_t{1});
  const std::vector<Radiance> dark(4, {Image<float>({kSide, kSide}), Image<float>({kSide, kSide}),
                                       Image<std::uint8_t>({kSide, kSide}, 1, std::uint8_t{1})});
  const std::vector<int> channel{0};
  const ShiftField field(dark, seen, true, channel);
  EXPECT_FALSE(field.found());
  EXPECT_EQ(field({10, 10}), 0);
}

TEST(RefinedMap, says_what_was_corrected) {
  const auto rig = open_virtual_rig(bench("vgroove-textured"));
  ASSERT_TRUE(rig.ok());
  const auto found = register_camera(**rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  EXPECT_TRUE(found->reciprocity.measured);
  EXPECT_LT(found->reciprocity.left, 0.002);
  const auto sharp = open_virtual_rig(
      "sim:vgroove-textured?size=48x48&fine=4&camera=228x228&turn=1.5&zoom=0.784&shift=3.3,-2.1");
  ASSERT_TRUE(sharp.ok());
  EXPECT_FALSE(register_camera(**sharp)->reciprocity.measured);
}

}  // namespace
}  // namespace symrig::reciprocal_shift_test
