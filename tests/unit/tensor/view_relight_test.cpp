// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/transport_operator.hpp"
#include "unit/tensor/random_tensor.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::view_relight_test {
namespace {

using tests::RandomTensor;
using tests::TensorAndMatrix;

constexpr ViewLayout kViews{2, 3};
constexpr Grid kCamera{5, 10};  // does not divide: tiles of 2 or 3 by 3 or 4
constexpr Grid kProjector{4, 9};

TensorAndMatrix general_tensor() {
  return RandomTensor(kCamera, kProjector, false, 1, 11).make(2, 2, 40);
}

Image<float> random_light(Grid grid) {
  Random random(4);
  Image<float> light(grid);
  for (float& v : light.values()) v = static_cast<float>(random.uniform());
  return light;
}

std::vector<std::size_t> tree_index(const BlockTree& tree) {
  std::vector<std::size_t> index(tree.order().size());
  for (std::size_t t = 0; t < index.size(); ++t) index[tree.order()[t]] = t;
  return index;
}

TEST(ViewRelight, is_the_block_of_the_matrix_between_two_views) {
  const TensorAndMatrix made = general_tensor();
  const auto camera = tree_index(made.tensor.camera_tree());
  const auto projector = tree_index(made.tensor.projector_tree());
  for (const View from : {View{0, 0}, View{1, 2}})
    for (const View to : {View{0, 1}, View{1, 0}}) {
      const ViewRelight what{kViews, from, to};
      const Tile lit = kViews.tile(kProjector, from), seen = kViews.tile(kCamera, to);
      ASSERT_EQ(*light_grid(made.tensor, what), lit.grid);
      const Image<float> light = random_light(lit.grid);
      const auto picture = relight(made.tensor, light, what);
      ASSERT_TRUE(picture.ok()) << picture.error().line();
      ASSERT_EQ(picture->grid(), seen.grid);
      for (int row = 0; row < seen.grid.rows; ++row)
        for (int col = 0; col < seen.grid.cols; ++col) {
          double sum = 0, size = 0;
          for (int r = 0; r < lit.grid.rows; ++r)
            for (int c = 0; c < lit.grid.cols; ++c) {
              const int at_camera = (seen.row + row) * kCamera.cols + seen.col + col;
              const int at_projector = (lit.row + r) * kProjector.cols + lit.col + c;
              const std::size_t i = camera[at_camera];
              const std::size_t j = projector[at_projector];
              sum += made.matrix[i * made.cols + j] * static_cast<double>(light.at(r, c));
              size += made.magnitude[i * made.cols + j] * static_cast<double>(light.at(r, c));
            }
          // The bound of TransportTensor::apply: |J| ≤ the projector's pixels, at most as many leaves, ε =
          // 2⁻²⁴.
          EXPECT_NEAR(picture->at(row, col), sum,
                      (0x1p-10 * (1 + 0x1p-11) + (2.0 * kProjector.size() + 4) * 0x1p-24) * size);
        }
    }
}

TEST(ViewRelight, without_views_it_is_the_whole_photograph) {
  const TensorAndMatrix made = general_tensor();
  const Image<float> light = random_light(kProjector);
  const auto whole = made.tensor.apply(light);
  EXPECT_EQ(*relight(made.tensor, light, {kViews, {}, {}}), *whole);
  const Tile seen = kViews.tile(kCamera, {1, 1});
  const auto part = relight(made.tensor, light, {kViews, {}, View{1, 1}});
  ASSERT_TRUE(part.ok());
  for (int row = 0; row < seen.grid.rows; ++row)
    for (int col = 0; col < seen.grid.cols; ++col)
      EXPECT_EQ(part->at(row, col), whole->at(seen.row + row, seen.col + col));
}

// Each light alone against all at once: the sums are in another order, so both are within apply's bound.
TEST(ViewRelight, many_lights_are_each_relit) {
  const TensorAndMatrix made = general_tensor();
  // Σ|A||B|ᵀ|light| of a pixel at most; light ≤ 1.
  double most = 0;
  for (std::size_t row = 0; row < made.magnitude.size(); row += made.cols)
    most = std::max(
        most, std::accumulate(made.magnitude.begin() + static_cast<std::ptrdiff_t>(row),
                              made.magnitude.begin() + static_cast<std::ptrdiff_t>(row + made.cols), 0.0));
  for (const ViewRelight& what : {ViewRelight{kViews, View{0, 1}, View{1, 2}}, ViewRelight{kViews, {}, {}}}) {
    const Grid grid = light_grid(made.tensor, what).value();
    std::vector<Image<float>> lights;
    for (int k = 0; k < 19; ++k) {
      lights.push_back(random_light(grid));
      for (float& v : lights.back().values()) v *= static_cast<float>(k % 5) / 4;
    }
    const auto pictures = relight_batch(made.tensor, lights, what);
    ASSERT_TRUE(pictures.ok()) << pictures.error().line();
    ASSERT_EQ(pictures->size(), lights.size());
    EXPECT_EQ(pictures->front().grid(), picture_grid(made.tensor, what).value());
    for (std::size_t k = 0; k < lights.size(); ++k) {
      const Image<float> alone = relight(made.tensor, lights[k], what).value();
      ASSERT_EQ((*pictures)[k].grid(), alone.grid());
      for (std::size_t i = 0; i < alone.values().size(); ++i)
        EXPECT_NEAR((*pictures)[k].values()[i], alone.values()[i],
                    2 * (2.0 * kProjector.size() + 4) * 0x1p-24 * most);
    }
    lights.emplace_back(Grid{1, 1});
    EXPECT_EQ(relight_batch(made.tensor, lights, what).error().code, ErrorCode::size_mismatch);
  }
}

TEST(ViewRelight, views_that_are_not_there_are_refused) {
  const TensorAndMatrix made = general_tensor();
  const auto code = [&](const ViewRelight& what) { return light_grid(made.tensor, what).error().code; };
  EXPECT_EQ(code({kViews, View{2, 0}, {}}), ErrorCode::bad_argument);
  EXPECT_EQ(code({kViews, {}, View{0, -1}}), ErrorCode::bad_argument);
  EXPECT_EQ(code({{5, 1}, {}, {}}), ErrorCode::bad_argument);  // more views than the projector has rows
  EXPECT_EQ(code({{0, 0}, {}, {}}), ErrorCode::bad_argument);
  const auto wrong = relight(made.tensor, random_light(kProjector), {kViews, View{0, 0}, {}});
  EXPECT_EQ(wrong.error().code, ErrorCode::size_mismatch);
}

TEST(ViewLayout, tiles_cover_the_grid_once_and_differ_by_a_pixel_at_most) {
  for (const Grid grid : {Grid{7, 10}, Grid{2, 3}, Grid{390, 601}})
    for (const ViewLayout views : {ViewLayout{1, 1}, ViewLayout{2, 3}, ViewLayout{1, 2}}) {
      ASSERT_TRUE(views.fits(grid));
      std::int64_t pixels = 0;
      for (int i = 0; i < views.rows; ++i)
        for (int j = 0; j < views.cols; ++j) {
          const Tile tile = views.tile(grid, {i, j});
          pixels += tile.grid.size();
          EXPECT_LE(std::abs(tile.grid.rows * views.rows - grid.rows), views.rows);
          EXPECT_LE(std::abs(tile.grid.cols * views.cols - grid.cols), views.cols);
          for (const auto& [row, col] : {std::pair{tile.row, tile.col},
                                         {tile.row + tile.grid.rows - 1, tile.col + tile.grid.cols - 1}})
            EXPECT_EQ(views.view_of(grid, row, col), (View{i, j}));
        }
      EXPECT_EQ(pixels, grid.size());
    }
  EXPECT_FALSE((ViewLayout{3, 1}.fits(Grid{2, 9})));
}

}  // namespace
}  // namespace symrig::view_relight_test
