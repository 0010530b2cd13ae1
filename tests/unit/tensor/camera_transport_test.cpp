// SPDX-License-Identifier: Apache-2.0
// T on the camera's own pixels: its sums, its packing, and what it refuses.
#include "symrig/base/statistics.hpp"
#include "unit/tensor/small_camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::camera_transport_test {
namespace {

using test::matrix_of;
using test::small_camera;
using Parts = CameraTransport::Parts;

Image<float> random_image(Grid grid, int channels, Random& random) {
  Image<float> image(grid, channels);
  for (float& v : image.values()) v = static_cast<float>(random.uniform()) - 0.25F;
  return image;
}

// A sum of n products of floats errs by at most n 2⁻²³ of the sum of their sizes.
constexpr double kRounding = 20 * 0x1p-23;

TEST(CameraTransport, is_its_matrix) {
  for (const int channels : {1, 3}) {
    const Parts parts = small_camera(channels);
    const CameraTransport camera = *CameraTransport::make(parts);
    EXPECT_EQ(camera.projector_grid(), (Grid{2, 3}));
    EXPECT_EQ(camera.camera_grid(), (Grid{3, 5}));
    EXPECT_EQ(camera.rows(), 14 * channels);
    const auto rows = matrix_of(parts);
    Random random(3);
    // More than one pass, and a last one that is not full.
    std::vector<Image<float>> lights;
    lights.reserve(19);
    for (int k = 0; k < 19; ++k) lights.push_back(random_image({2, 3}, 1, random));
    const std::vector<Image<float>> photographs = *camera.apply_batch(lights);
    const Image<float> seen = random_image({3, 5}, channels, random), back = *camera.adjoint(seen);
    for (std::size_t k = 0; k < lights.size(); ++k) {
      const Image<float> one = *camera.apply(lights[k]);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        double sum = 0, size = 0;
        for (std::size_t j = 0; j < 6; ++j) sum += rows[i][j] * lights[k].values()[j];
        for (const double a : rows[i]) size += 4 * std::abs(a);
        EXPECT_NEAR(one.values()[i], sum, kRounding * (size + 10)) << i;
        EXPECT_NEAR(photographs[k].values()[i], sum, kRounding * (size + 10)) << i;
      }
    }
    for (std::size_t j = 0; j < 6; ++j) {
      double sum = 0, size = 0;
      for (std::size_t i = 0; i < rows.size(); ++i)
        sum += rows[i][j] * seen.values()[i], size += std::abs(rows[i][j]) + 1;
      EXPECT_NEAR(back.values()[j], sum, 4 * kRounding * size);
    }
    for (int c = 0; c < channels; ++c) EXPECT_EQ(photographs[0].at(2, 4, c), 0);  // has no row
  }
}

TEST(CameraTransport, of_a_mosaic_has_light_in_the_colour_of_each_pixel) {
  const CameraTransport camera = *CameraTransport::make(test::small_mosaic());
  const Image<float> photograph = *camera.apply(Image<float>({2, 3}, 1, 1.F));
  EXPECT_GT(photograph.at(0, 0, 1), 0);  // G R
  EXPECT_GT(photograph.at(0, 1, 0), 0);  // B G
  EXPECT_GT(photograph.at(1, 0, 2), 0);
  for (int pixel = 0; pixel < 15; ++pixel) {
    int seen = 0;
    for (int c = 0; c < 3; ++c) seen += photograph.at(pixel / 5, pixel % 5, c) != 0 ? 1 : 0;
    EXPECT_EQ(seen, pixel < 14 ? 1 : 0) << pixel;
  }
}

TEST(CameraTransport, takes_pictures_of_its_own_size_only) {
  const CameraTransport camera = *CameraTransport::make(small_camera());
  EXPECT_EQ(camera.apply(Pattern({3, 2})).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(camera.apply(Image<float>({2, 3}, 3)).error().code, ErrorCode::size_mismatch);
  const std::vector<Image<float>> lights{Image<float>({2, 3}), Image<float>({3, 2})};
  EXPECT_EQ(camera.apply_batch(lights).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(camera.adjoint(Image<float>({2, 3})).error().code, ErrorCode::size_mismatch);
}

// Columns from large to tiny, and one of nothing; one pixel is nearly dark. Each coefficient is right to the
// step of its column, where that is named twice to the step of the second, and no coarse step is left. A
// column that is left out adds less than 1e-4 of the usual light.
TEST(PackedRows, are_right_to_half_a_step) {
  Random random(5);
  for (const std::size_t pixels : {1U, 2U, 14U}) {
    const std::vector<CameraTransport::Column> columns{0, 1, 2, 3, -1, -2, -3, -4, -5};
    const std::vector<float> shown{1, 1, 4, 4, 1, 1, 1, 1, 1};
    std::vector<float> rows(pixels * columns.size()), light(pixels);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double bright = i / columns.size() == 1 ? 1e-3 : 1 + 0.5 * random.uniform();
      const double alike = std::pow(10.0, -static_cast<double>(i % columns.size()) / 2);
      rows[i] = i % columns.size() == 4 ? 0 : static_cast<float>(bright * alike * random.uniform());
      light[i / columns.size()] += shown[i % columns.size()] * rows[i];
    }
    const PackedRows packed = pack_rows(columns, shown, rows, light);
    ASSERT_EQ(packed.codes.size(), pixels * packed.columns.size());
    double usual = 0;
    for (std::size_t i = 0; i < pixels; ++i)
      usual += light[i] / packed.brightness[i] / static_cast<float>(pixels);
    std::size_t left_out = 0;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (std::ranges::find(packed.columns, columns[k]) != packed.columns.end()) continue;
      ++left_out;
      for (std::size_t i = 0; i < pixels; ++i)
        EXPECT_LE(rows[i * columns.size() + k] * shown[k], 1.001e-4 * usual * packed.brightness[i]);
    }
    EXPECT_GE(left_out, 1);  // that of nothing
    EXPECT_EQ(packed.columns.size() + left_out > columns.size(), pixels > 1);
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t k = 0; k < columns.size(); ++k) {
        if (std::ranges::find(packed.columns, columns[k]) == packed.columns.end()) continue;
        double found = 0, step = 0;
        for (std::size_t n = 0; n < packed.columns.size(); ++n)
          if (packed.columns[n] == columns[k]) {
            step = tensor::from_half(packed.steps[n]);
            found += tensor::from_half(packed.middles[n]) +
                     tensor::from_half(packed.steps[n]) * packed.codes[i * packed.columns.size() + n];
          }
        const double value = rows[i * columns.size() + k], half = packed.brightness[i] * step / 2;
        EXPECT_NEAR(packed.brightness[i] * found, value, half * (1 + 1e-4) + 4e-7 * std::abs(value)) << k;
      }
    }
    for (std::size_t n = 0; n < packed.columns.size(); ++n) {
      const bool again = n > 0 && packed.columns[n] == packed.columns[n - 1];
      const std::size_t k = std::ranges::find(columns, packed.columns[n]) - columns.begin();
      const bool coarse = tensor::from_half(packed.steps[n]) * shown[k] > 5e-4 * usual;
      EXPECT_EQ(coarse && !again,
                n + 1 < packed.columns.size() && packed.columns[n + 1] == packed.columns[n]);
      if (again) {
        EXPECT_LE(tensor::from_half(packed.steps[n]), tensor::from_half(packed.steps[n - 1]) / 254 * 1.002F);
      }
    }
  }
}

TEST(PackedRows, of_nothing_are_nothing) {
  const std::vector<float> rows(6), light(2), shown(3, 1.F);
  const std::vector<CameraTransport::Column> columns{0, 1, -1};
  const PackedRows packed = pack_rows(columns, shown, rows, light);
  EXPECT_TRUE(packed.columns.empty());
  EXPECT_TRUE(packed.codes.empty());
  EXPECT_EQ(pack_rows({}, {}, {}, light).brightness.size(), 2);
}

TEST(CameraTransport, refuses_parts_that_do_not_fit) {
  const auto refused = [](const std::string& what, auto change) {
    Parts parts = small_camera(3);
    change(parts);
    const auto made = CameraTransport::make(std::move(parts));
    ASSERT_FALSE(made.ok()) << what;
    EXPECT_EQ(made.error().code, ErrorCode::bad_value);
    EXPECT_NE(made.error().what.find(what), std::string::npos) << made.error().what;
  };
  ASSERT_TRUE(CameraTransport::make(small_camera(3)).ok());
  refused("a basis", [](Parts& p) { p.bases[0].begin = -1; });
  refused("a basis", [](Parts& p) { p.bases[1].end = 7; });
  refused("a basis", [](Parts& p) { p.bases[1].end = 4; });
  refused("a basis", [](Parts& p) { p.bases[1].rank = 3; });
  refused("a basis", [](Parts& p) { p.bases[1].rank = 0; });
  refused("a basis", [](Parts& p) { p.bases[1].first = 1; });
  refused("values of the bases", [](Parts& p) { p.basis_values.push_back(0); });
  refused("a value of the bases", [](Parts& p) { p.basis_values[3] = tensor::to_half(1.25F); });
  refused("a value of the bases", [](Parts& p) { p.basis_values[3] = 0x7C00; });
  refused("the number of a column", [](Parts& p) { p.columns[0] = 3; });
  refused("the number of a column", [](Parts& p) { p.columns[0] = -7; });
  refused("the number of a column", [](Parts& p) { p.columns[0] = std::numeric_limits<int>::min(); });
  refused("a group", [](Parts& p) { p.groups[1].channel = 3; });
  refused("a group", [](Parts& p) { p.groups[1].pixels = -1; });
  refused("a group", [](Parts& p) { p.groups[1].columns = -1; });
  refused("codes", [](Parts& p) { p.groups[0] = {0, INT32_MAX, INT32_MAX}; });
  refused("codes", [](Parts& p) { p.codes.pop_back(); });
  refused("columns", [](Parts& p) { p.columns.push_back(0); });
  refused("columns", [](Parts& p) { p.middles.pop_back(); });
  refused("columns", [](Parts& p) { p.steps.pop_back(); });
  refused("pixels", [](Parts& p) { p.pixels.pop_back(); });
  refused("pixels", [](Parts& p) { p.brightness.push_back(1); });
  refused("the number of a pixel", [](Parts& p) { p.pixels[0] = 15; });
  refused("the number of a pixel", [](Parts& p) { p.pixels[0] = -1; });
  refused("named twice", [](Parts& p) { p.pixels[0] = p.pixels[9]; });
  refused("the size of the camera", [](Parts& p) { p.camera = {0, 5}; });
  refused("the colour filters", [](Parts& p) { p.mosaic = "RG"; });
  refused("that its pixel does not see", [](Parts& p) { p.mosaic = "RGGB"; });
  refused("the size of a coefficient", [](Parts& p) { p.middles[2] = 0x7C00; });
  refused("the size of a coefficient", [](Parts& p) { p.steps[2] = 0x7E00; });
  refused("the size of a coefficient", [](Parts& p) { p.brightness[2] = 0x1p59F; });
  refused("brightness", [](Parts& p) { p.brightness[2] = -1; });
  refused("brightness", [](Parts& p) { p.brightness[2] = std::nanf(""); });
}

}  // namespace
}  // namespace symrig::camera_transport_test
