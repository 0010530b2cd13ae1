// SPDX-License-Identifier: Apache-2.0
// Combs show by reciprocity where a map is wrong.
#include "calibration/registration/reciprocal_shift.hpp"

#include "calibration/registration/comb_pairs.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

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
