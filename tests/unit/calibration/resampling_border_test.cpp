// SPDX-License-Identifier: Apache-2.0
// A flood-lit projector as a camera sees it: pixels that the border cuts see dark beside it. Each pixel is
// cut exactly, as a polygon; no formula is shared with the code under test.
#include "symrig/calibration/resampling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

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
