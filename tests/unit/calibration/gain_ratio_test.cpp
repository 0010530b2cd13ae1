// SPDX-License-Identifier: Apache-2.0
// The gain of the camera over that of the projector, from light that travels both ways.
#include "symrig/calibration/gain_ratio.hpp"

#include "symrig/calibration/registration.hpp"
#include "symrig/sim/bench_truth.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

namespace symrig::gain_ratio_test {
namespace {

/// A rig with gains: cells of the camera count more, cells of the projector shine more, and the camera
/// spreads a share of all light evenly over its picture.
class GainedProbe final : public Probe {
 public:
  GainedProbe(Probe& rig, Image<float> camera, Image<float> projector, double veil)
      : rig_(rig), camera_(std::move(camera)), projector_(std::move(projector)), veil_(veil) {}

  Grid grid() const override { return rig_.grid(); }
  int channels() const override { return rig_.channels(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    std::vector<Radiance> seen;
    for (const Pattern& pattern : patterns) {
      Pattern lit = pattern;
      for (std::size_t i = 0; i < lit.values().size(); ++i) lit.values()[i] *= projector_.values()[i];
      SYMRIG_TRY(auto one, rig_.measure({&lit, 1}));
      Image<float>& mean = one.front().mean;
      double all = 0;
      for (std::size_t i = 0; i < mean.values().size(); ++i)
        all += double{mean.values()[i] *= camera_.values()[i]};
      const auto even = static_cast<float>(veil_ * all / static_cast<double>(mean.values().size()));
      for (float& v : mean.values()) v += even;
      seen.push_back(std::move(one.front()));
    }
    return seen;
  }
  ProbeCost cost() const override { return rig_.cost(); }
  std::string describe() const override { return "gained " + rig_.describe(); }

 private:
  Probe& rig_;
  Image<float> camera_, projector_;
  double veil_;
};

Image<float> falloff(Grid grid, double loss, double to_row) {
  Image<float> gain(grid);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const double y = (row + 0.5) / grid.rows - to_row, x = (col + 0.5) / grid.cols - 0.5;
      gain.at(row, col) = static_cast<float>(1 - 2 * loss * (y * y + x * x));
    }
  return gain;
}

/// rms of log(found / true), both with mean log 0.
double rms(const Image<float>& found, const Image<float>& camera, const Image<float>& projector) {
  double sum = 0, square = 0;
  const auto n = static_cast<double>(found.values().size());
  for (std::size_t i = 0; i < found.values().size(); ++i) {
    const double off =
        std::log(double{found.values()[i]} * double{projector.values()[i]} / double{camera.values()[i]});
    sum += off;
    square += off * off;
  }
  return std::sqrt(square / n - std::pow(sum / n, 2));
}

struct Case {
  const char* scene;
  double veil;
};

class FoundGain : public testing::TestWithParam<Case> {};

// The bar of the registration: 1 %, with a veiling glare of 0.2 % of all light. The falloff of a lens about a
// middle of its own is a sum of the shapes up to its fourth order: 0.35² / 2 of the square's curvature.
TEST_P(FoundGain, is_the_true_one_to_a_percent) {
  const auto rig = open_virtual_rig(GetParam().scene);
  ASSERT_TRUE(rig.ok());
  const Grid grid = (*rig)->grid();
  const Image<float> camera = falloff(grid, 0.2, 0.44), projector = falloff(grid, 0.35, 0.5);
  GainedProbe probe(**rig, camera, projector, GetParam().veil);
  const auto gain = measure_gain_ratio(probe, Image<std::uint8_t>(grid, 1, std::uint8_t{1}));
  ASSERT_TRUE(gain.ok()) << gain.error().line();
  ASSERT_TRUE(gain->known);
  EXPECT_LE(rms(gain->over(grid), camera, projector), 0.01);
  EXPECT_LE(gain->sigma, 0.01);
  // A sixteenth of the light that is spread over the whole picture falls into a block.
  EXPECT_NEAR(gain->veil, GetParam().veil / 16, std::max(5 * gain->veil_sigma, 1e-5));
}

INSTANTIATE_TEST_SUITE_P(Scenes, FoundGain,
                         testing::Values(Case{"sim:vgroove-white?size=32x32", 0},
                                         Case{"sim:vgroove-white?size=32x32", 0.002},
                                         Case{"sim:vgroove-textured?size=32x40", 0.002},
                                         Case{"sim:occluder?size=32x32", 0}));

TEST(GainRatio, a_scene_whose_parts_exchange_no_light_tells_nothing) {
  const auto rig = open_virtual_rig("sim:plane?size=32x32");
  ASSERT_TRUE(rig.ok());
  const auto gain = measure_gain_ratio(**rig, Image<std::uint8_t>({32, 32}, 1, std::uint8_t{1}));
  ASSERT_TRUE(gain.ok());
  EXPECT_FALSE(gain->known);
  EXPECT_EQ(gain->spread({32, 32}), 1);
}

TEST(GainRatio, a_tiny_grid_is_not_measured) {
  const auto rig = open_virtual_rig("sim:plane?size=7x32");
  ASSERT_TRUE(rig.ok());
  const auto gain = measure_gain_ratio(**rig, Image<std::uint8_t>({7, 32}, 1, std::uint8_t{1}));
  ASSERT_TRUE(gain.ok());
  EXPECT_FALSE(gain->known);
  EXPECT_EQ((*rig)->cost().photographs, 0);
  EXPECT_FALSE(measure_gain_ratio(**rig, Image<std::uint8_t>({7, 31}, 1)).ok());
}

// The whole registration of a bench with vignetting on both sides.
TEST(GainRatio, is_part_of_a_registration) {
  const auto rig = open_virtual_rig(
      "sim:vgroove-textured?size=32x32&fine=2&camera=152x152&turn=1.5&zoom=0.784&shift=3.3,-2.1&vignetting=0."
      "2,"
      "0.35");
  ASSERT_TRUE(rig.ok());
  const auto found = register_camera(**rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  EXPECT_EQ(found->photographs, 22 + 6 + 2 + 16);
  const auto truth = bench_gain((*rig)->uri());
  ASSERT_TRUE(truth.ok());
  EXPECT_LE(rms(found->gain.over({32, 32}), *truth, Image<float>({32, 32}, 1, 1.F)), 0.01);
}

}  // namespace
}  // namespace symrig::gain_ratio_test
