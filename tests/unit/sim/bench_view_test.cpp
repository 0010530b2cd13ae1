// SPDX-License-Identifier: Apache-2.0
// A simulated bench: its map, and what its camera sees.
// T of a bench with a camera of its own, through the exact map.

#include "sim/scenes.hpp"
#include "sim/view.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cmath>
#include <numbers>
#include <numeric>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::bench_view_test {

namespace {

using sim::BenchMap;

SceneUri uri_of(const std::string& text) {
  auto uri = parse_scene_uri(text);
  EXPECT_TRUE(uri.ok()) << uri.error().line();
  return *std::move(uri);
}

Point look(const std::string& text, Point camera, int channel = 0, double moved = 0) {
  const SceneUri uri = uri_of(text);
  return BenchMap(uri, sim::find_scene(uri.name)->depth).look(camera, channel, moved);
}

void expect_at(Point found, double row, double col) {
  EXPECT_NEAR(found.row, row, 1e-12);
  EXPECT_NEAR(found.col, col, 1e-12);
}

// 40 x 60 cells; four camera pixels along the side of a cell.
const std::string kBench = "sim:plane?size=40x60&camera=160x240";

TEST(BenchMap, without_keys_the_pictures_cover_each_other) {
  expect_at(look(kBench, {0, 0}), 0, 0);
  expect_at(look(kBench, {160, 240}), 40, 60);
  expect_at(look(kBench, {10, 100}), 2.5, 25);
}

TEST(BenchMap, the_cells_fit_into_a_camera_of_another_shape) {
  // 240 x 240 pixels: 4 a cell, and the camera sees 10 cells above and below.
  expect_at(look("sim:plane?size=40x60&camera=240x240", {0, 0}), -10, 0);
}

TEST(BenchMap, shift_and_moves_are_in_cells) {
  expect_at(look(kBench + "&shift=7.3,-4.1", {0, 0}), 7.3, -4.1);
  expect_at(look(kBench + "&shift=7.3,-4.1&misalign=0.5", {0, 0}, 0, 0.25), 8.05, -3.35);
}

TEST(BenchMap, zoom_enlarges_the_cells_in_the_camera) {
  // Half as large: the camera sees twice as far from the middle.
  expect_at(look(kBench + "&zoom=0.5", {0, 0}), -20, -30);
}

TEST(BenchMap, turn_is_about_the_middle) {
  // A quarter turn: 120 pixels to the right of the middle are 30 cells above it or below it.
  expect_at(look(kBench + "&turn=90", {80, 240}), 50, 30);
  expect_at(look(kBench + "&turn=-90", {80, 240}), -10, 30);
}

TEST(BenchMap, distortion_is_that_of_the_corner) {
  // The corner is 1 half diagonal from the middle: 2 % further out.
  expect_at(look(kBench + "&distortion=0.02", {0, 0}), -0.4, -0.6);
  // Half way it is an eighth of that.
  expect_at(look(kBench + "&distortion=0.02", {40, 60}), 10 - 0.05, 15 - 0.075);
}

TEST(BenchMap, colours_are_apart_at_the_corner) {
  const std::string bench = kBench + "&channels=3&colour=0.2";
  const Point red = look(bench, {0, 0}, 0), green = look(bench, {0, 0}, 1), blue = look(bench, {0, 0}, 2);
  EXPECT_NEAR(std::hypot(red.row - blue.row, red.col - blue.col), 0.2, 1e-12);
  expect_at(green, 0, 0);
  expect_at(look(bench, {80, 120}, 0), 20, 30);
}

// The seen point p solves p + (0, parallax · depth(p)) = q, and the nearest and the farthest point are
// `parallax` apart.
TEST(BenchMap, parallax_depends_on_depth) {
  const std::string bench = "sim:vgroove-white?size=40x60&camera=160x240";
  const SceneUri uri = uri_of(bench);
  const auto depth = sim::find_scene(uri.name)->depth;
  double least = 1, most = -1;
  for (const double col : {3.0, 60.0, 112.8, 170.0, 239.0}) {
    const Point p = look(bench + "&parallax=0.7", {80, col}), q = look(bench, {80, col});
    EXPECT_NEAR(p.row, q.row, 1e-12);
    EXPECT_NEAR(p.col + 0.7 * depth({40, 60}, p), q.col, 1e-10);
  }
  for (int col = 0; col <= 600; ++col) {
    const double z = depth({40, 60}, {20, col / 10.0});
    least = std::min(least, z), most = std::max(most, z);
  }
  EXPECT_NEAR(most - least, 1, 1e-12);
}

Image<float> seen(const std::string& text, const Image<float>& light, std::uint64_t before = 0) {
  const auto bench = sim::make_bench(uri_of(text));
  EXPECT_TRUE(bench.ok()) << bench.error().line();
  return bench->view->see(light, before);
}

Image<float> some_light(Grid cells) {
  Image<float> light(cells);
  for (int row = 0; row < cells.rows; ++row)
    for (int col = 0; col < cells.cols; ++col)
      light.at(row, col) = static_cast<float>((row * 7 + col * 5) % 11) / 10;
  return light;
}

// With camera pixels that are cells, a bench is the coaxial rig. Sums in another order: a few roundings.
TEST(BenchView, a_camera_of_cells_sees_the_ideal_photograph) {
  for (const std::string scene : {"vgroove-textured", "gummy", "mirror", "views2"})
    for (const std::string fine : {"1", "3"}) {
      const std::string text = fmt::format("sim:{}?size=12x16&fine={}", scene, fine);
      const Image<float> light = some_light({12, 16});
      const Image<float> ideal = make_scene(uri_of(text)).value()->apply(light);
      const Image<float> bench = seen(text + "&camera=12x16", light);
      for (std::size_t i = 0; i < ideal.values().size(); ++i)
        EXPECT_NEAR(bench.values()[i], ideal.values()[i], 1e-6) << scene << fine;
    }
}

// Pixels that tile a cell see it together, however the scene's points lie in them.
TEST(BenchView, camera_pixels_share_a_cell) {
  const std::string text = "sim:vgroove-textured?size=12x16&fine=2";
  const Image<float> light = some_light({12, 16});
  const Image<float> cells = seen(text + "&camera=12x16", light),
                     pixels = seen(text + "&camera=36x48", light);
  for (int row = 0; row < 12; ++row)
    for (int col = 0; col < 16; ++col) {
      double sum = 0;
      for (int i = 0; i < 9; ++i) sum += static_cast<double>(pixels.at(3 * row + i / 3, 3 * col + i % 3));
      EXPECT_NEAR(sum / 9, cells.at(row, col), 1e-6);
    }
}

TEST(BenchView, vignetting_is_the_loss_at_the_corner) {
  const std::string text = "sim:plane?size=16x16&camera=160x160";
  const Image<float> light({16, 16}, 1, 1.F);
  const Image<float> plain = seen(text, light), camera = seen(text + "&vignetting=0.2,0", light),
                     projector = seen(text + "&vignetting=0,0.35", light);
  EXPECT_NEAR(camera.at(0, 0) / plain.at(0, 0), 0.8,
              0.005);  // the middle of the corner's pixel is 0.6 % inside
  EXPECT_NEAR(camera.at(80, 80) / plain.at(80, 80), 1, 1e-4);
  const double inside = 15.0 / 16;  // the projector's corner is the middle of its cell
  EXPECT_NEAR(projector.at(0, 0) / plain.at(0, 0), 1 - 0.35 * inside * inside, 1e-6);
}

TEST(BenchView, a_ghost_is_a_second_picture) {
  const std::string text = "sim:plane?size=16x16&camera=64x64";
  Image<float> light({16, 16});
  light.at(9, 6) = 1;
  const Image<float> plain = seen(text, light), ghost = seen(text + "&ghost=0.1@2,-3", light);
  // Pixel (28, 36) looks at cell (7, 9), and its ghost shows cell (9, 6).
  EXPECT_EQ(plain.at(29, 37), 0);
  EXPECT_NEAR(ghost.at(29, 37), 0.1F * plain.at(37, 25), 1e-7);
  EXPECT_NEAR(ghost.at(37, 25), 0.9F * plain.at(37, 25), 1e-7);
}

/// The variance of a picture's light along its rows [pixels²].
double spread_along(const Image<float>& picture) {
  double sum = 0, first = 0, second = 0;
  for (int row = 0; row < picture.grid().rows; ++row)
    for (int col = 0; col < picture.grid().cols; ++col) {
      const auto v = static_cast<double>(picture.at(row, col));
      sum += v, first += v * col, second += v * col * col;
    }
  return second / sum - first * first / sum / sum;
}

// On a white plane both defocuses add their variance to that of the cell. The Gaussians are sampled at the
// scene's points, a sixth of a cell apart, and cut at five sigmas: below 1 %.
TEST(BenchView, defocus_adds_its_variance) {
  const std::string text = "sim:vgroove-white?size=16x16&fine=6&indirect=0&camera=96x96";
  Image<float> light({16, 16});
  light.at(8, 4) = 1;
  const double per_cell = 36, plain = spread_along(seen(text, light)) / per_cell;
  for (const std::string both : {"0.4,0", "0,0.4", "0.4,0.3"}) {
    const double blurred = spread_along(seen(fmt::format("{}&defocus={}", text, both), light)) / per_cell;
    EXPECT_NEAR(blurred - plain, both == "0.4,0.3" ? 0.25 : 0.16, 0.0025) << both;
  }
}

TEST(BenchView, a_camera_that_moves_sees_what_a_shifted_one_sees) {
  const std::string text = "sim:gummy?size=16x16&camera=64x64";
  const Image<float> light = some_light({16, 16});
  EXPECT_EQ(seen(text + "&moves=1", light, 0), seen(text, light));
  EXPECT_EQ(seen(text + "&moves=1", light, 250), seen(text + "&shift=0.25,0.25", light));
}

TEST(BenchView, each_channel_has_its_map) {
  const std::string text = "sim:plane?size=16x16&channels=3&camera=64x64";
  const Image<float> light = some_light({16, 16});
  const Image<float> plain = seen(text, light), coloured = seen(text + "&colour=0.5", light);
  double change[3] = {};
  for (int c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < plain.plane(c).size(); ++i)
      change[c] += std::abs(static_cast<double>(coloured.plane(c)[i] - plain.plane(c)[i]));
  EXPECT_GT(change[0], 1);
  EXPECT_EQ(change[1], 0);
  EXPECT_GT(change[2], 1);
}

TEST(Bench, refuses_what_does_not_fit_together) {
  EXPECT_EQ(parse_scene_uri("sim:plane?psf=0.1&turn=1").error().code, ErrorCode::bad_argument);
  EXPECT_EQ(make_scene(uri_of("sim:plane?size=2048x2048&fine=4")).error().code, ErrorCode::limit);
  EXPECT_EQ(sim::make_bench(uri_of("sim:plane?camera=9000x9000")).error().code, ErrorCode::limit);
}

}  // namespace

}  // namespace symrig::bench_view_test

namespace symrig::bench_truth_test {

namespace {

/// ‖T − Tᵀ‖ / ‖T‖ by random signs p and q: E[(qᵀTp − pᵀTq)²] = ‖T − Tᵀ‖², and E‖Tp‖² = ‖T‖².
double asymmetry(const TrueTransport& truth, Grid grid, int tries) {
  Random random(7);
  const auto signs = [&] {
    Image<float> image(grid);
    for (float& v : image.values()) v = random.sign();
    return image;
  };
  const auto product = [](const Image<float>& a, const Image<float>& b) {
    return std::inner_product(a.values().begin(), a.values().end(), b.values().begin(), 0.0);
  };
  double difference = 0, all = 0;
  for (int k = 0; k < tries; ++k) {
    const Image<float> p = signs(), q = signs();
    const auto of_p = truth(p), of_q = truth(q);
    EXPECT_TRUE(of_p.ok() && of_q.ok());
    difference += std::pow(product(q, *of_p) - product(p, *of_q), 2);
    all += product(*of_p, *of_p);
  }
  return std::sqrt(difference / all);
}

double asymmetry_of(const std::string& keys, int size = 32, int camera = 152, int tries = 24) {
  const auto uri = parse_scene_uri(fmt::format(
      "sim:vgroove-textured?size={0}x{0}&camera={1}x{1}&turn=1.5&zoom=0.784{2}", size, camera, keys));
  EXPECT_TRUE(uri.ok());
  const auto truth = bench_truth(*uri);
  EXPECT_TRUE(truth.ok() && truth->has_value());
  return asymmetry(**truth, uri->size, tries);
}

// What blurs of second moments leave: pixels are boxes, not Gaussians. If a pixel's side counted as w² / 12,
// or not at all, the first would be 0.0044 and 0.0054 (24 November 2026); a perfect match leaves 0.0036.
TEST(BenchTruth, is_symmetric) {
  EXPECT_LT(asymmetry_of("&fine=4&defocus=0.15,0.3"), 0.0040);
  EXPECT_LT(asymmetry_of("&fine=8&defocus=0.15,0.3"), 0.0030);
  EXPECT_LT(asymmetry_of("&fine=4&defocus=0.1,0.4"), 0.0052);
}

// For the sanitizers: few cells and few tries. 0.0051 (25 November 2026); four tries scatter by a third.
TEST(BenchTruth, is_symmetric_on_a_small_grid) {
  EXPECT_LT(asymmetry_of("&fine=4&defocus=0.15,0.3", 12, 57, 4), 0.011);
}

}  // namespace

}  // namespace symrig::bench_truth_test
