// SPDX-License-Identifier: Apache-2.0
// A flood-lit projector as a camera sees it: pixels that the border cuts see dark beside it. Each pixel is
// cut exactly, as a polygon; no formula is shared with the code under test.
#include "symrig/calibration/pixel_map.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::resampling_test {
namespace {

/// The map col = a + scale · camera col, likewise rows, where both lie on the projector.
PixelMap affine(Grid camera, Grid projector, double scale, double begin) {
  PixelMap map{.camera = camera,
               .projector = projector,
               .col = Image<float>(camera),
               .row = Image<float>(camera),
               .mask = Image<std::uint8_t>(camera),
               .col_sigma = {},
               .row_sigma = {},
               .contrast = {}};
  for (int r = 0; r < camera.rows; ++r)
    for (int c = 0; c < camera.cols; ++c) {
      const double x = begin + scale * c, y = begin + scale * r;
      if (x < 0 || y < 0 || x > projector.cols - 1 || y > projector.rows - 1) continue;
      map.col.at(r, c) = static_cast<float>(x);
      map.row.at(r, c) = static_cast<float>(y);
      map.mask.at(r, c) = 1;
    }
  return map;
}

/// The bent map of the synthetic scene, shadow left out.
PixelMap bent() {
  const test::SyntheticScene scene;
  PixelMap map = affine(scene.camera, scene.projector, 0, 0);
  for (int r = 0; r < scene.camera.rows; ++r)
    for (int c = 0; c < scene.camera.cols; ++c) {
      map.col.at(r, c) = static_cast<float>(scene.col(r, c));
      map.row.at(r, c) = static_cast<float>(test::SyntheticScene::row(r, c));
      const bool inside =
          scene.col(r, c) < scene.projector.cols && test::SyntheticScene::row(r, c) < scene.projector.rows;
      map.mask.at(r, c) = inside && !test::SyntheticScene::shadow(r, c) ? 1 : 0;
    }
  return map;
}

Image<float> random(Grid grid, std::uint64_t seed) {
  Image<float> image(grid);
  std::uint64_t counter = seed << 32;
  for (float& v : image.values()) v = static_cast<float>(test::normal(counter));
  return image;
}

double dot(const Image<float>& a, const Image<float>& b) {
  return std::transform_reduce(
      a.values().begin(), a.values().end(), b.values().begin(), 0.0, std::plus{},
      [](float x, float y) { return static_cast<double>(x) * static_cast<double>(y); });
}

double norm(const Image<float>& a) {
  return std::sqrt(dot(a, a));
}

TEST(Resampling, TheSamePixelsAreTheIdentity) {
  const Grid grid{7, 9};
  const auto r = Resampling::from_map(affine(grid, grid, 1, 0));
  ASSERT_TRUE(r.ok()) << r.error().line();
  const Image<float> x = random(grid, 1);
  EXPECT_EQ(r->to_projector(x).value(), x);
  EXPECT_EQ(r->to_camera(x).value(), x);
  EXPECT_EQ(r->weights(), 63U);
}

// Outputs are sums of 64 bits rounded once to 32: relative 2⁻²⁴ of each, so that <y, R x> and <Rᵀ y, x>
// differ by at most 2 · 2⁻²⁴ |x| |y| ‖R‖, and ‖R‖² ≤ ‖R‖₁ ‖R‖∞ = 1 · max coverage.
TEST(Resampling, ToCameraIsTheTransposeOfToProjector) {
  const PixelMap map = bent();
  const auto r = Resampling::from_map(map);
  ASSERT_TRUE(r.ok()) << r.error().line();
  const double largest = std::sqrt(static_cast<double>(std::ranges::max(r->coverage().values())));
  for (std::uint64_t seed = 1; seed < 6; ++seed) {
    const Image<float> x = random(map.camera, seed), y = random(map.projector, 10 + seed);
    const double there = dot(y, r->to_projector(x).value()), back = dot(r->to_camera(y).value(), x);
    EXPECT_NEAR(there, back, 2 * 0x1p-24 * norm(x) * norm(y) * largest);
    EXPECT_GT(std::abs(there), 1e-3);  // not nought on both sides
  }
}

// Weights of a pixel are rounded to 32 bits (at most 9 of them), results again.
TEST(Resampling, LightIsNeitherMadeNorLost) {
  const PixelMap map = bent();
  const auto r = Resampling::from_map(map);
  ASSERT_TRUE(r.ok()) << r.error().line();
  Image<float> x = random(map.camera, 3);
  for (float& v : x.values()) v = std::abs(v);
  double decoded = 0, there = 0;
  for (std::size_t i = 0; i < x.values().size(); ++i)
    decoded += map.mask.values()[i] ? static_cast<double>(x.values()[i]) : 0;
  const Image<float> y = r->to_projector(x).value();
  for (const float v : y.values()) there += static_cast<double>(v);
  EXPECT_NEAR(there, decoded, 10 * 0x1p-24 * decoded);
  // What a camera pixel sees of a flood-lit projector is all of it.
  const Image<float> seen = r->to_camera(Image<float>(map.projector, 1, 1)).value();
  for (std::size_t i = 0; i < x.values().size(); ++i)
    EXPECT_NEAR(seen.values()[i], map.mask.values()[i] ? 1 : 0, 10 * 0x1p-24) << i;
}

// A camera finer or coarser than the projector: boxes lie edge to edge, so that inside the picture each
// projector pixel gets 1 / scale² camera pixels, and no hole is left. Positions of 32 bits below 64 move an
// edge by 64 · 2⁻²⁴.
TEST(Resampling, EvenMapsCoverEvenly) {
  for (const double scale : {0.37, 0.62, 1.7, 2.9}) {
    const Grid projector{60, 50};
    const Grid camera{static_cast<int>(70 / scale), static_cast<int>(60 / scale)};
    const auto r = Resampling::from_map(affine(camera, projector, scale, -4.2));
    ASSERT_TRUE(r.ok()) << r.error().line();
    for (int row = 6; row < projector.rows - 6; ++row)
      for (int col = 6; col < projector.cols - 6; ++col)
        EXPECT_NEAR(r->coverage().at(row, col) * scale * scale, 1, 1e-4)
            << scale << ": " << row << ", " << col;
  }
}

// A picture that is linear on the projector is a stair of its pixels there: a box that lies inside one pixel
// sees that pixel's value, half a pixel off at most in each axis, 0.5 (1 + 2) together, and nothing on
// average.
TEST(Resampling, ALinearPictureStaysItself) {
  const PixelMap map = bent();
  const auto r = Resampling::from_map(map);
  ASSERT_TRUE(r.ok()) << r.error().line();
  Image<float> ramp(map.projector);
  for (int row = 0; row < map.projector.rows; ++row)
    for (int col = 0; col < map.projector.cols; ++col) ramp.at(row, col) = static_cast<float>(col + 2 * row);
  const Image<float> seen = r->to_camera(ramp).value();
  double sum = 0;
  int count = 0;
  for (int row = 5; row < 90; ++row)
    for (int col = 5; col < 120; ++col) {
      const float truth = map.col.at(row, col) + 2 * map.row.at(row, col);
      ASSERT_NEAR(seen.at(row, col), truth, 1.5) << row << ", " << col;
      sum += static_cast<double>(seen.at(row, col) - truth);
      ++count;
    }
  EXPECT_NEAR(sum / count, 0, 0.02);
  const Image<float> back = r->mean_on_projector(seen).value();
  sum = 0, count = 0;
  for (int row = 8; row < 50; ++row)
    for (int col = 12; col < 75; ++col) {
      EXPECT_NEAR(back.at(row, col), ramp.at(row, col), 1.5);
      sum += static_cast<double>(back.at(row, col) - ramp.at(row, col));
      ++count;
    }
  EXPECT_NEAR(sum / count, 0, 0.05);
}

TEST(Resampling, RefusesOtherSizesAndPlacesOffTheProjector) {
  const auto r = Resampling::from_map(bent());
  ASSERT_TRUE(r.ok());
  EXPECT_EQ(r->to_projector(Image<float>(Grid{3, 3})).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(r->to_camera(Image<float>(Grid{3, 3})).error().code, ErrorCode::size_mismatch);
  PixelMap off = bent();
  off.col.at(5, 5) = 1e6F;
  const auto refused = Resampling::from_map(off);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_value);
  EXPECT_NE(refused.error().line().find("(5, 5)"), std::string::npos) << refused.error().line();
  off.col.at(5, 5) = std::nanf("");
  EXPECT_FALSE(Resampling::from_map(off).ok());
}

}  // namespace
}  // namespace symrig::resampling_test

namespace symrig::resampling_border_test {
namespace {

struct Point {
  double x = 0, y = 0;
};
using Polygon = std::vector<Point>;

double area(const Polygon& polygon) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    sum += a.x * b.y - b.x * a.y;
  }
  return std::abs(sum) / 2;
}

/// What of it lies where inside(p) ≥ 0, inside linear in p.
template <class Inside>
Polygon clipped(const Polygon& polygon, Inside inside) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double at_a = inside(a), at_b = inside(b);
    if (at_a >= 0) kept.push_back(a);
    if ((at_a >= 0) == (at_b >= 0)) continue;
    const double t = at_a / (at_a - at_b);
    kept.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
  }
  return kept;
}

/// A camera turned by `turn`, whose pixels are `zoom` projector pixels wide.
struct View {
  double turn = 0, zoom = 1;
};

class Flood {
 public:
  static constexpr Grid kProjector{24, 32};

  explicit Flood(const View& view) : view_(view) {
    const int side = static_cast<int>(46 / view.zoom);
    camera_ = {side, side + 3};
  }

  PixelMap map() const {
    PixelMap map{.camera = camera_,
                 .projector = kProjector,
                 .col = Image<float>(camera_),
                 .row = Image<float>(camera_),
                 .mask = Image<std::uint8_t>(camera_),
                 .col_sigma = {},
                 .row_sigma = {},
                 .contrast = {}};
    for (int r = 0; r < camera_.rows; ++r)
      for (int c = 0; c < camera_.cols; ++c) {
        const Point p = seen(r, c);
        if (p.x < -0.5 || p.y < -0.5 || p.x > kProjector.cols - 0.5 || p.y > kProjector.rows - 0.5) continue;
        map.col.at(r, c) = static_cast<float>(p.x);
        map.row.at(r, c) = static_cast<float>(p.y);
        map.mask.at(r, c) = 1;
      }
    return map;
  }

  /// The share of each camera pixel that is lit.
  Image<float> photograph() const {
    Image<float> image(camera_);
    for (int r = 0; r < camera_.rows; ++r)
      for (int c = 0; c < camera_.cols; ++c) {
        Polygon pixel{seen(r - 0.5, c - 0.5), seen(r - 0.5, c + 0.5), seen(r + 0.5, c + 0.5),
                      seen(r + 0.5, c - 0.5)};
        const double whole = area(pixel);
        pixel = clipped(pixel, [](const Point& p) { return p.x + 0.5; });
        pixel = clipped(pixel, [](const Point& p) { return kProjector.cols - 0.5 - p.x; });
        pixel = clipped(pixel, [](const Point& p) { return p.y + 0.5; });
        pixel = clipped(pixel, [](const Point& p) { return kProjector.rows - 0.5 - p.y; });
        image.at(r, c) = static_cast<float>(area(pixel) / whole);
      }
    return image;
  }

 private:
  Point seen(double r, double c) const {
    const double x = view_.zoom * (c - (camera_.cols - 1) / 2.0 + 0.37),
                 y = view_.zoom * (r - (camera_.rows - 1) / 2.0 - 0.21);
    return {(kProjector.cols - 1) / 2.0 + std::cos(view_.turn) * x - std::sin(view_.turn) * y,
            (kProjector.rows - 1) / 2.0 + std::sin(view_.turn) * x + std::cos(view_.turn) * y};
  }

  View view_;
  Grid camera_;
};

class Border : public testing::TestWithParam<View> {};

// A pixel that lies wholly on the projector is lit wholly; the photograph is rounded once. Sums are 64 bits
// wide; the picture, both of its sums and their ratio are rounded to 32 bits: 4 half units in all.
TEST_P(Border, a_flood_lit_projector_has_one_brightness) {
  const Flood flood(GetParam());
  const auto resampling = Resampling::from_map(flood.map());
  ASSERT_TRUE(resampling.ok()) << resampling.error().line();
  const Image<float> mean = resampling->mean_on_projector(flood.photograph()).value();
  int seen = 0;
  for (int row = 0; row < Flood::kProjector.rows; ++row)
    for (int col = 0; col < Flood::kProjector.cols; ++col) {
      if (resampling->coverage().at(row, col) == 0) continue;
      ++seen;
      EXPECT_NEAR(mean.at(row, col), 1, 4 * 0x1p-24) << row << ", " << col;
    }
  EXPECT_EQ(seen, Flood::kProjector.size());
}

// A picture that is the same everywhere, cut pixels included, has no other mean at any zoom.
TEST_P(Border, a_constant_picture_stays_constant) {
  const Flood flood(GetParam());
  const PixelMap map = flood.map();
  const auto resampling = Resampling::from_map(map);
  ASSERT_TRUE(resampling.ok()) << resampling.error().line();
  const Image<float> mean = resampling->mean_on_projector(Image<float>(map.camera, 1, 0.7F)).value();
  for (std::size_t j = 0; j < mean.values().size(); ++j)
    if (resampling->coverage().values()[j] > 0) {
      EXPECT_NEAR(mean.values()[j], 0.7F, 4 * 0x1p-24) << j;
    }
}
// Turns up to a quarter; two to six camera pixels to a projector pixel, as a calibrated rig has.
INSTANTIATE_TEST_SUITE_P(Views, Border,
                         testing::Values(View{0, 0.25}, View{0.026, 0.93 / 4}, View{-0.026, 0.27},
                                         View{0.3, 0.2}, View{0.785, 0.21}, View{1.5707963, 0.25},
                                         View{0.1, 0.17}, View{-0.5, 0.3}));

// Where the camera is coarser than the projector, cut pixels are all that tells.
TEST(Border, cells_that_only_cut_pixels_see_have_a_mean_too) {
  const Flood flood({0.1, 1.9});
  const PixelMap map = flood.map();
  const auto resampling = Resampling::from_map(map);
  ASSERT_TRUE(resampling.ok()) << resampling.error().line();
  const Image<float> mean = resampling->mean_on_projector(Image<float>(map.camera, 1, 0.7F)).value();
  for (std::size_t j = 0; j < mean.values().size(); ++j)
    if (resampling->coverage().values()[j] > 0) {
      EXPECT_NEAR(mean.values()[j], 0.7F, 4 * 0x1p-24) << j;
    }
}

}  // namespace
}  // namespace symrig::resampling_border_test
