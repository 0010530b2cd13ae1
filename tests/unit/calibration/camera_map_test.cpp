// SPDX-License-Identifier: Apache-2.0
// Maps that are found from Gray-code photographs of simulated benches, against their exact maps.
#include "symrig/calibration/camera_map.hpp"

#include "calibration/fitting/spline_surface.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::camera_map_test {
namespace {

using calibration::SeenValue;
using calibration::SplineSurface;
using test::normal;

double cubic(Point p) {
  const double y = p.row / 50, x = p.col / 50;
  return 3 + 2 * y - x + 0.5 * x * y + 0.1 * x * x * x - 0.2 * y * x * x;
}

std::vector<SeenValue> seen(double noise, int step) {
  std::uint64_t counter = 1;
  std::vector<SeenValue> values;
  for (int row = 0; row < 60; row += step)
    for (int col = 0; col < 80; col += step) {
      const Point at{row + 0.5, col + 0.5};
      values.push_back({at, cubic(at) + noise * normal(counter), 1});
    }
  return values;
}

// Cubic polynomials have no fourth differences: any smoothing finds them, to the ridge of 1e-10.
TEST(SplineSurface, finds_a_cubic_polynomial_without_bias) {
  for (const double smoothing : {1e-4, 1.0, 1e3}) {
    SplineSurface surface({60, 80}, 12);
    ASSERT_TRUE(surface.fit(seen(0, 3), smoothing));
    for (const Point p : {Point{0, 0}, Point{30, 40}, Point{60, 80}, Point{17.3, 71.9}})
      EXPECT_NEAR(surface(p), cubic(p), 1e-6) << smoothing;
  }
}

// Smoothed to a cubic polynomial, sixteen numbers are fitted to n values: rms error = noise · √(16 / n), and
// three of its standard deviations, 1 / √(2 · 16) each, more.
TEST(SplineSurface, noise_averages_out) {
  SplineSurface surface({60, 80}, 12);
  const auto values = seen(0.1, 1);
  ASSERT_TRUE(surface.fit(values, 1e5));
  double sum = 0;
  for (const SeenValue& v : values) sum += std::pow(surface(v.at) - cubic(v.at), 2);
  const auto n = static_cast<double>(values.size());
  EXPECT_LE(std::sqrt(sum / n), 0.1 * std::sqrt(16 / n) * (1 + 3 / std::sqrt(32.0)));
}

TEST(SplineSurface, too_few_values_change_nothing) {
  SplineSurface surface({60, 80}, 12);
  EXPECT_FALSE(surface.fit(std::vector<SeenValue>(3, SeenValue{{1, 1}, 5, 1}), 1));
  EXPECT_EQ(surface({1, 1}), 0);
}

std::vector<Radiance> code_photographs(Probe& rig) {
  auto photographs = rig.measure(gray_code_patterns(rig.grid()));
  EXPECT_TRUE(photographs.ok()) << photographs.error().line();
  return *std::move(photographs);
}

struct MapError {
  double row = 0, col = 0;  ///< rms over the corners that look at a cell [cells]
};

MapError error_of(const CornerMap& found, const CornerMap& exact, Grid cells) {
  double sums[2] = {}, count = 0;
  for (int row = 0; row < exact.grid().rows; ++row)
    for (int col = 0; col < exact.grid().cols; ++col) {
      const double r = exact.at(row, col, 0), c = exact.at(row, col, 1);
      if (r < 0 || c < 0 || r > cells.rows || c > cells.cols) continue;
      count += 1;
      sums[0] += std::pow(found.at(row, col, 0) - r, 2);
      sums[1] += std::pow(found.at(row, col, 1) - c, 2);
    }
  return {std::sqrt(sums[0] / count), std::sqrt(sums[1] / count)};
}

struct BenchCase {
  std::string name, scene, bench;
  double bound;  ///< [cells] rms per axis
};

class FoundMap : public testing::TestWithParam<BenchCase> {};

// Bounds: an edge errs by the texture inside its pixel, 0.05 pixels of a quarter of a cell. 32 x 32 cells
// have about 7,000 edges for two axes, and the spline at most 13² numbers for each, so texture alone gives
// 0.0125 · √(169 / 3500) = 0.0027 cells. The blurred bench has a systematic error too: without noise it is
// 0.0084 cells. Its bound is 0.01.
TEST_P(FoundMap, is_the_exact_map_to_its_bound) {
  const auto rig = open_virtual_rig(GetParam().scene + GetParam().bench);
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  const auto photographs = code_photographs(**rig);
  const auto maps = fit_camera_maps((*rig)->grid(), photographs);
  ASSERT_TRUE(maps.ok()) << maps.error().line();
  const auto exact = (*rig)->exact_corners();
  for (std::size_t c = 0; c < maps->size(); ++c) {
    const CameraMap& map = (*maps)[c].map;
    const MapError error = error_of(map.corners(), exact[exact.size() == 1 ? 0 : c], (*rig)->grid());
    EXPECT_LE(error.row, GetParam().bound) << "channel " << c;
    EXPECT_LE(error.col, GetParam().bound) << "channel " << c;
    EXPECT_GT(map.error(), 0);
    EXPECT_LE(map.error(), GetParam().bound);
    EXPECT_GT(map.edges(), 1000);
  }
}

constexpr const char* kScene = "sim:vgroove-textured?size=32x32&fine=4";
constexpr const char* kBenchA = "&camera=152x152&turn=1.5&zoom=0.784&shift=3.3,-2.1&distortion=0.02";

INSTANTIATE_TEST_SUITE_P(
    Benches, FoundMap,
    testing::Values(BenchCase{"A", kScene, kBenchA, 0.003},
                    BenchCase{"Colours", "sim:plane?size=32x32&fine=4&channels=3&colour=0.2", kBenchA, 0.003},
                    BenchCase{"OnItsSide", kScene, "&camera=120x150&turn=93&shift=-2,3", 0.003},
                    BenchCase{"UpsideDown", kScene, "&camera=130x130&turn=180&zoom=0.9", 0.003},
                    BenchCase{"SeesAPart", kScene, "&camera=100x120&zoom=1.6&shift=4,-3", 0.003},
                    BenchCase{"Aligned", kScene, "&camera=128x128", 0.003},
                    BenchCase{"Blurred", kScene,
                              std::string(kBenchA) + "&vignetting=0.2,0.35&defocus=0.15,0.3&parallax=0.3",
                              0.01}),
    [](const auto& one) { return one.param.name; });

// The room goes on beside the projector's picture. Walls there are a little glossy, and show the picture
// mirrored and blurred: wide stripes, but no fine ones. The bound is that of the bench without.
TEST(CameraMap, is_not_misled_by_what_the_picture_lights_beside_it) {
  const auto rig =
      *open_virtual_rig("sim:vgroove-textured?size=32x32&fine=4&camera=152x152&turn=1.5&zoom=0.784");
  const CornerMap exact = rig->exact_corners().front();
  const Grid cells = rig->grid(), camera = rig->camera_grid();
  const auto patterns = gray_code_patterns(cells);
  auto photographs = code_photographs(*rig);
  for (int row = 0; row < camera.rows; ++row)
    for (int col = 0; col < camera.cols; ++col) {
      const double y = exact.at(row, col, 0), x = exact.at(row, col, 1);
      if (y >= -0.5 && x >= -0.5 && y <= cells.rows && x <= cells.cols) continue;
      const double from_row = y < 0 ? -y : std::min(y, 2 * cells.rows - y);
      const double from_col = x < 0 ? -x : std::min(x, 2 * cells.cols - x);
      Image<double> light(cells);
      for (int i = 0; i < cells.rows; ++i)
        for (int j = 0; j < cells.cols; ++j) {
          const double away = std::hypot(from_row - i - 0.5, from_col - j - 0.5);
          light.at(i, j) = 0.004 * std::exp(-away * away / 18);
        }
      for (std::size_t k = 0; k < patterns.size(); ++k) {
        double sum = 0;
        for (std::size_t i = 0; i < light.values().size(); ++i)
          sum += light.values()[i] * static_cast<double>(patterns[k].values()[i]);
        photographs[k].mean.at(row, col) += static_cast<float>(sum);
      }
    }
  const auto maps = fit_camera_maps(cells, photographs);
  ASSERT_TRUE(maps.ok()) << maps.error().line();
  const MapError error = error_of(maps->front().map.corners(), exact, cells);
  EXPECT_LE(error.row, 0.003);
  EXPECT_LE(error.col, 0.003);
}

// Blobs of a quarter of the picture are as black as velvet, 60 to 85 % of it in all. The map is right where
// the scene is seen, and elsewhere a guess that bends it by no more than a cell; none of it is taken for
// parallax.
TEST(CameraMap, of_a_dark_scene_does_not_swing) {
  for (int seed = 1; seed <= 6; ++seed) {
    const auto rig = *open_virtual_rig(fmt::format("{}{}&seed={}", kScene, kBenchA, seed));
    const CornerMap exact = rig->exact_corners().front();
    const Grid cells = rig->grid(), camera = rig->camera_grid();
    auto photographs = code_photographs(*rig);
    std::uint64_t counter = std::uint64_t(seed) << 32;
    Image<double> field(camera);
    for (int wave = 0; wave < 6; ++wave) {
      const double down = normal(counter) / 20, right = normal(counter) / 20, at = 3 * normal(counter);
      const double height = normal(counter);
      for (int row = 0; row < camera.rows; ++row)
        for (int col = 0; col < camera.cols; ++col)
          field.at(row, col) += height * std::cos(down * row + right * col + at);
    }
    const double level =
        quantile(std::vector<double>(field.values().begin(), field.values().end()), 0.55 + 0.05 * seed);
    const auto is_dark = [&](Point at) {
      return field.at(static_cast<int>(at.row), static_cast<int>(at.col)) < level;
    };
    for (Radiance& one : photographs)
      for (std::size_t i = 0; i < field.values().size(); ++i)
        if (field.values()[i] < level) one.mean.values()[i] *= 0.002F;
    const auto maps = fit_camera_maps(cells, photographs);
    ASSERT_TRUE(maps.ok()) << maps.error().line();
    const CameraMap& map = maps->front().map;
    const CornerMap found = map.corners();
    EXPECT_LE(map.error(), 0.1);
    double bright = 0, count = 0, farthest = 0;
    for (int row = 0; row < camera.rows; ++row)
      for (int col = 0; col < camera.cols; ++col) {
        const double y = exact.at(row, col, 0), x = exact.at(row, col, 1);
        if (y < 0 || x < 0 || y > cells.rows || x > cells.cols) continue;
        const double off = std::hypot(found.at(row, col, 0) - y, found.at(row, col, 1) - x);
        farthest = std::max(farthest, off);
        if (is_dark({row + 0.5, col + 0.5})) continue;
        bright += off * off, count += 1;
      }
    EXPECT_LE(std::sqrt(bright / count), 0.1) << seed;
    EXPECT_LE(farthest, 1) << seed;
    const MapShape shape = shape_of(
        camera, [&](Point at) { return map.look(at); }, cells, [&](Point at) { return !is_dark(at); });
    EXPECT_LE(shape.parallax.range, 0.1) << seed;
    EXPECT_NEAR(shape.turn, 1.5, 0.1) << seed;
  }
}

TEST(CameraMap, says_how_many_pixels_a_cell_has) {
  const auto rig = open_virtual_rig(std::string(kScene) + kBenchA);
  ASSERT_TRUE(rig.ok());
  const auto photographs = code_photographs(**rig);
  const auto maps = fit_camera_maps({32, 32}, photographs);
  ASSERT_TRUE(maps.ok());
  EXPECT_NEAR(maps->front().map.pixels_per_cell(), 152.0 / 32 * 0.784, 0.01);
  EXPECT_LE(maps->front().map.outlier_share(), 0.02);
}

// A sharp edge is as wide as a pixel, 1 / 3.72 cells and a little more because the camera is turned. The
// middle of a blurred one has the slope of a Gaussian: √(2π) sigmas, with the pixel's own sigma, its side /
// √12.
TEST(CameraMap, says_how_wide_an_edge_is) {
  for (const double blur : {0.0, 0.4}) {
    const auto rig =
        open_virtual_rig("sim:plane?size=32x32&fine=4&defocus=" + std::to_string(blur) + ",0" + kBenchA);
    ASSERT_TRUE(rig.ok()) << rig.error().line();
    const auto photographs = code_photographs(**rig);
    const auto maps = fit_camera_maps({32, 32}, photographs);
    ASSERT_TRUE(maps.ok()) << maps.error().line();
    const double side = 1 / 3.72;
    const double expected =
        blur == 0 ? side : std::sqrt(2 * std::numbers::pi) * std::hypot(blur, side / std::sqrt(12));
    EXPECT_NEAR(maps->front().map.edge_width(), expected, 0.15 * expected) << blur;
  }
}

TEST(CameraMap, refuses_what_is_no_gray_code) {
  const auto rig = open_virtual_rig("sim:plane?size=16x16&camera=60x60");
  ASSERT_TRUE(rig.ok());
  auto photographs = code_photographs(**rig);
  EXPECT_EQ(fit_camera_maps({64, 64}, photographs).error().code, ErrorCode::size_mismatch);
  // A camera that sees no stripes: its pictures are all alike.
  for (Radiance& one : photographs) one = photographs.front();
  const auto maps = fit_camera_maps({16, 16}, photographs);
  ASSERT_FALSE(maps.ok());
  EXPECT_EQ(maps.error().code, ErrorCode::bad_value);
  EXPECT_NE(maps.error().line().find("see the stripes"), std::string::npos) << maps.error().line();
  photographs.back() =
      Radiance{Image<float>({60, 59}), Image<float>({60, 59}), Image<std::uint8_t>({60, 59})};
  EXPECT_EQ(fit_camera_maps({16, 16}, photographs).error().code, ErrorCode::size_mismatch);
}

}  // namespace
}  // namespace symrig::camera_map_test
