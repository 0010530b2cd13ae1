// SPDX-License-Identifier: Apache-2.0
// The gain of the camera over that of the projector, from light that travels both ways.
// A second picture in the camera is found, and taken out of photographs.
#include "symrig/calibration/camera_optics.hpp"

#include "cell_views.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include <fmt/format.h>
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

namespace symrig::ghost_test {
namespace {

using test::corners_of;
using test::seen;

constexpr const char* kBench =
    "?size=32x32&exposures=4&fine=4&camera=152x152&turn=1.5&zoom=0.784&shift=3.3,-2.1&distortion=0.02";
constexpr const char* kBlurred = "&vignetting=0.2,0.35&defocus=0.15,0.3&parallax=0.3";
constexpr const char* kBlurredThird = "&vignetting=0.2,0.35&defocus=0.15,0.3&parallax=0.3&seed=3";

Registration registration_of(const std::string& uri) {
  const auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << rig.error().line();
  auto found = register_camera(**rig);
  EXPECT_TRUE(found.ok()) << found.error().line();
  return *std::move(found);
}

struct Case {
  const char *scene, *keys;
  double share;
  Point place;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.scene << c.keys << " " << c.share << "@" << c.place.row << "," << c.place.col;
}

class FoundGhost : public testing::TestWithParam<Case> {};

// The bars are a fifth of the share, and a cell. Photographs tell more: the place to a camera pixel, which is
// 0.27 cells wide.
TEST_P(FoundGhost, is_the_true_one) {
  const Case& c = GetParam();
  const Registration found = registration_of(
      fmt::format("sim:{}{}{}&ghost={}@{},{}", c.scene, kBench, c.keys, c.share, c.place.row, c.place.col));
  ASSERT_TRUE(found.ghost.found) << found.ghost.significance;
  EXPECT_GT(found.ghost.significance, CameraGhost::sigmas);
  EXPECT_NEAR(found.ghost.share, c.share, 0.2 * c.share);
  EXPECT_NEAR(found.ghost.share, c.share, 5 * found.ghost.sigma);
  EXPECT_NEAR(found.ghost.place.row, c.place.row, 0.27);
  EXPECT_NEAR(found.ghost.place.col, c.place.col, 0.27);
  // Pixels beyond the cells see the ghost only, and must not bend the map.
  EXPECT_LT(found.error(), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Benches, FoundGhost,
                         testing::Values(Case{"vgroove-textured", "", 0.01, {4.3, -2.6}},
                                         Case{"plane", "&seed=2", 0.01, {-5, 0}},
                                         Case{"gummy", "&seed=3", 0.02, {0.4, 5.7}},
                                         Case{"mirror", "", 0.01, {-3.5, 2.2}},
                                         Case{"occluder", kBlurred, 0.01, {2.5, 7.5}},
                                         Case{"vgroove-mixed", "&channels=3&colour=0.2", 0.01, {-4.25, -4.5}},
                                         Case{"vgroove-white", kBlurred, 0.02, {-8.6, 3.3}},
                                         Case{"vgroove-white", kBlurredThird, 0.02, {-8.6, 3.3}}));

struct Without {
  const char *scene, *keys;
};

void PrintTo(const Without& c, std::ostream* out) {
  *out << c.scene << c.keys;
}

class NoGhost : public testing::TestWithParam<Without> {};

TEST_P(NoGhost, is_found) {
  const Registration found =
      registration_of(fmt::format("sim:{}{}{}", GetParam().scene, kBench, GetParam().keys));
  EXPECT_FALSE(found.ghost.found) << found.ghost.significance;
  EXPECT_EQ(found.ghost.share, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, NoGhost,
    testing::Values(Without{"plane", ""}, Without{"vgroove-white", ""}, Without{"vgroove-mixed", "&seed=2"},
                    Without{"vgroove-textured", ""}, Without{"gummy", ""}, Without{"occluder", "&seed=3"},
                    Without{"mirror", ""}, Without{"plane", kBlurred}, Without{"vgroove-white", kBlurred},
                    Without{"vgroove-mixed", kBlurred}, Without{"vgroove-textured", kBlurred},
                    Without{"gummy", kBlurred}, Without{"occluder", kBlurred}, Without{"mirror", kBlurred}));

// A plane exchanges no light, so all that dark cells see is the ghost. The share is right to a fifth, so less
// than a fifth is left.
TEST(Ghost, is_taken_out_of_photographs) {
  const auto rig = open_virtual_rig(fmt::format("sim:plane{}&ghost=0.01@4.3,-2.6", kBench));
  ASSERT_TRUE(rig.ok());
  Registration found = *register_camera(**rig);
  ASSERT_TRUE(found.ghost.found);
  Pattern block({32, 32}, 1);
  for (int row = 12; row < 20; ++row)
    for (int col = 12; col < 20; ++col) block.at(row, col) = 1;
  const auto far_light = [&](const Registration& registration) {
    auto weights = registration.weights();
    EXPECT_TRUE(weights.ok()) << weights.error().line();
    const auto photograph = RegisteredProbe(**rig, *std::move(weights)).measure({&block, 1});
    EXPECT_TRUE(photograph.ok());
    double sum = 0;
    for (int row = 0; row < 32; ++row)
      for (int col = 0; col < 32; ++col)
        if (row < 11 || row > 20 || col < 11 || col > 20)
          sum += std::abs(static_cast<double>(photograph->front().mean.at(row, col)));
    return sum;
  };
  const double without = far_light(found);
  found.ghost = {};
  EXPECT_GT(far_light(found), 5 * without);
}

TEST(Ghost, small_grids_are_not_measured) {
  const auto rig = open_virtual_rig("sim:plane?size=8x40&camera=48x200&ghost=0.1@0,5");
  ASSERT_TRUE(rig.ok());
  const std::int64_t before = (*rig)->cost().photographs;
  const CornerMap corners = corners_of({48, 200}, 5, 0, {});
  const Radiance even = test::photograph({48, 200}, 1, 1);
  const auto ghost = measure_ghost(**rig, test::weights_of({8, 40}, corners, even), {&corners, 1});
  ASSERT_TRUE(ghost.ok());
  EXPECT_FALSE(ghost->found);
  EXPECT_EQ((*rig)->cost().photographs, before);
}

TEST(Ghost, patterns_are_even) {
  const auto patterns = ghost_patterns({36, 48});
  ASSERT_EQ(patterns.size(), 6U);
  for (const Pattern& pattern : patterns)
    for (int top = 0; top < 36; top += 6)
      for (int left = 0; left < 48; left += 6) {
        float sum = 0;
        for (int i = 0; i < 36; ++i) sum += pattern.at(top + i / 6, left + i % 6);
        EXPECT_EQ(sum, 4);
      }
  EXPECT_NE(patterns[0], patterns[1]);
}

CameraGhost ghost_of(double share, Point place) {
  CameraGhost ghost;
  ghost.found = true;
  ghost.share = share;
  ghost.place = place;
  return ghost;
}

double waves(Point p) {
  return 1 + 0.5 * std::sin(2 * std::numbers::pi * p.row / 8) * std::cos(2 * std::numbers::pi * p.col / 8);
}

// Light between pixels is a bilinear mean: it errs by an eighth of the second derivatives, (2π / 29.8)² / 2
// per pixel² along each axis, so by 0.0056. That counts by the share; 1e-5 is left by the substitution, and
// floats round.
TEST(WithoutGhost, undoes_a_ghost) {
  const Grid camera{90, 110};
  const Point place{2.3, -3.7};
  constexpr double kShare = 0.02;
  const CornerMap corners = corners_of(camera, 3.72, 1.5, {});
  const Radiance plain = seen(corners, waves);
  const Radiance doubled = seen(corners, [&](Point p) {
    return (1 - kShare) * waves(p) + kShare * waves({p.row + place.row, p.col + place.col});
  });
  const auto found = without_ghost(doubled, {&corners, 1}, ghost_of(kShare, place));
  ASSERT_TRUE(found.ok()) << found.error().line();
  double before = 0, after = 0;
  // 30 pixels from the border, the ghost of each pixel comes from inside of the picture, and the ghost of
  // that.
  for (int row = 30; row < camera.rows - 30; ++row)
    for (int col = 30; col < camera.cols - 30; ++col) {
      ASSERT_TRUE(found->valid.at(row, col));
      const auto truth = static_cast<double>(plain.mean.at(row, col));
      before = std::max(before, std::abs(static_cast<double>(doubled.mean.at(row, col)) - truth));
      after = std::max(after, std::abs(static_cast<double>(found->mean.at(row, col)) - truth));
    }
  EXPECT_GT(before, 0.01);
  EXPECT_LT(after, kShare / (1 - kShare) * 0.0056 + 1.5e-5 + 1e-6);
  EXPECT_GT(after, 0);
}

// The ghost of the pixel (i, j) is the pixel (i + 8, j). The last 8 rows have none.
TEST(WithoutGhost, keeps_to_the_border_and_to_valid_pixels) {
  const Grid camera{40, 40};
  const CornerMap corners = corners_of(camera, 4, 0, {});
  Radiance flat = test::photograph(camera, 1, 0.5F);
  for (int row = 20; row < 23; ++row)
    for (int col = 10; col < 13; ++col) {
      flat.mean.at(row, col) = 0;
      flat.variance.at(row, col) = 0;
      flat.valid.at(row, col) = 0;
    }
  const auto found = without_ghost(flat, {&corners, 1}, ghost_of(0.1, {2, 0}));
  ASSERT_TRUE(found.ok()) << found.error().line();
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col) {
      const bool hole = row >= 20 && row < 23 && col >= 10 && col < 13;
      const bool unknown = row >= 12 && row < 15 && col >= 10 && col < 13;
      ASSERT_EQ(found->valid.at(row, col), hole || unknown ? 0 : 1) << row << " " << col;
      if (hole || unknown) {
        EXPECT_EQ(found->mean.at(row, col), 0);
        EXPECT_EQ(found->variance.at(row, col), 0);
      } else if (row >= 32) {
        EXPECT_NEAR(found->mean.at(row, col), 0.5 / 0.9, 1e-6);
        EXPECT_NEAR(found->variance.at(row, col), 1e-4 / 0.81, 1e-9);
      } else {
        EXPECT_NEAR(found->variance.at(row, col), 1e-4 * 1.01 / 0.81, 1e-9);
      }
    }
  // Far from the border, a flat picture and its ghost are as bright as the picture.
  EXPECT_NEAR(found->mean.at(2, 30), 0.5, 2e-4);
}

TEST(WithoutGhost, refuses_what_no_ghost_has) {
  const Grid camera{20, 20};
  const CornerMap corners = corners_of(camera, 4, 0, {}), other = corners_of({21, 20}, 4, 0, {});
  const Radiance flat = test::photograph(camera, 1, 0.5F);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const CameraGhost& wrong :
       {ghost_of(-0.01, {3, 0}), ghost_of(0.3, {3, 0}), ghost_of(nan, {3, 0}), ghost_of(0.01, {nan, 0})}) {
    EXPECT_EQ(without_ghost(flat, {&corners, 1}, wrong).error().code, ErrorCode::bad_value);
    auto weights = test::weights_of({5, 5}, corners, flat);
    EXPECT_EQ(weights.subtract_ghost({&corners, 1}, wrong).error().code, ErrorCode::bad_value);
  }
  EXPECT_EQ(without_ghost(flat, {&other, 1}, ghost_of(0.01, {3, 0})).error().code, ErrorCode::size_mismatch);
  auto weights = test::weights_of({5, 5}, corners, flat);
  EXPECT_EQ(weights.subtract_ghost({&other, 1}, ghost_of(0.01, {3, 0})).error().code,
            ErrorCode::size_mismatch);
}

}  // namespace
}  // namespace symrig::ghost_test
