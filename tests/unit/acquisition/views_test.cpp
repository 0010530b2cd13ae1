// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/views.hpp"

#include "sim/light/optics.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>

namespace symrig::views_test {
namespace {

Radiance exact(Image<float> mean) {
  const Grid grid = mean.grid();
  const int channels = mean.channels();
  return {std::move(mean), Image<float>(grid, channels), Image<std::uint8_t>(grid, channels, 1)};
}

SceneUri uri_of(const std::string& text) {
  auto uri = parse_scene_uri(text + "&noise=off");
  EXPECT_TRUE(uri.ok()) << uri.error().line();
  return *std::move(uri);
}

Radiance flood_lit(const SceneUri& uri) {
  const auto scene = make_scene(uri);
  return exact((*scene)->apply(Image<float>(uri.size, 1, 1.0F)));
}

/// A pixel outside the reference view, the place matched, and how far off it is.
struct Error2d {
  double distance;
  float confidence;
};

/// The point that a place in the reference view shows, between its four pixels; nothing past its border.
std::optional<std::pair<float, float>> shown_at(const Image<float>& truth, const Tile& tile, float row,
                                                float col) {
  const float y = row - 0.5F, x = col - 0.5F;
  if (y < 0 || x < 0 || y > static_cast<float>(tile.grid.rows - 1) ||
      x > static_cast<float>(tile.grid.cols - 1))
    return std::nullopt;
  const int r = std::min(static_cast<int>(y), tile.grid.rows - 2),
            c = std::min(static_cast<int>(x), tile.grid.cols - 2);
  const float v = y - static_cast<float>(r), u = x - static_cast<float>(c);
  const auto at = [&](int axis) {
    const auto pixel = [&](int i, int j) { return truth.at(tile.row + r + i, tile.col + c + j, axis); };
    return (1 - v) * ((1 - u) * pixel(0, 0) + u * pixel(0, 1)) +
           v * ((1 - u) * pixel(1, 0) + u * pixel(1, 1));
  };
  return std::pair{at(0), at(1)};
}

/// Compares with the points that the simulator's optics see. units: scene pixels.
std::vector<Error2d> errors_of(const MatchedViews& matched, ViewLayout views, const Image<float>& truth) {
  std::vector<Error2d> errors;
  const Grid grid = truth.grid();
  const Tile reference = views.tile(grid, matched.reference);
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      if (views.view_of(grid, row, col) == matched.reference) continue;
      const auto shown =
          shown_at(truth, reference, matched.surface.at(row, col, 0), matched.surface.at(row, col, 1));
      const double distance =
          shown ? std::hypot(shown->first - truth.at(row, col, 0), shown->second - truth.at(row, col, 1))
                : 1e9;
      errors.push_back({distance, matched.confidence.at(row, col)});
    }
  return errors;
}

/// Of the pixels with a match, the share that is within half a pixel: what any whole-pixel search must reach,
/// and what keeps two pixels that see one point in the same or in neighbouring places of the tree.
double share_right(const std::vector<Error2d>& errors) {
  std::ptrdiff_t matched = 0, right = 0;
  for (const Error2d& e : errors) {
    if (e.confidence < 0.5F) continue;
    ++matched;
    right += e.distance <= 0.5 ? 1 : 0;
  }
  return static_cast<double>(right) / static_cast<double>(std::max<std::ptrdiff_t>(matched, 1));
}

double share_matched(const std::vector<Error2d>& errors) {
  return static_cast<double>(
             std::ranges::count_if(errors, [](const Error2d& e) { return e.confidence >= 0.5F; })) /
         static_cast<double>(errors.size());
}

struct Rig {
  const char* scene;
  ViewLayout views;
};

class SimulatedViews : public testing::TestWithParam<Rig> {};
INSTANTIATE_TEST_SUITE_P(Rigs, SimulatedViews,
                         testing::Values(Rig{"sim:views2?size=128x128", {2, 2}},
                                         Rig{"sim:views2?size=97x150", {2, 2}},
                                         Rig{"sim:views3?size=144x144", {3, 3}},
                                         Rig{"sim:views3?size=130x250", {3, 3}}),
                         [](const auto& rig) { return "case" + std::to_string(rig.index); });

TEST_P(SimulatedViews, are_matched_to_half_a_pixel_of_the_known_parallax) {
  const SceneUri uri = uri_of(GetParam().scene);
  ASSERT_EQ(views_of(uri), GetParam().views);
  const auto matched = match_views(flood_lit(uri), GetParam().views);
  ASSERT_TRUE(matched.ok()) << matched.error().line();
  const auto errors =
      errors_of(*matched, GetParam().views, sim::tiled_views(uri.size, GetParam().views).surface);
  EXPECT_GE(share_right(errors), 0.9);
  EXPECT_GE(share_matched(errors), 0.9);
}

TEST_P(SimulatedViews, survive_noise_brightness_and_dead_pixels) {
  const SceneUri uri = uri_of(GetParam().scene);
  Radiance flood = flood_lit(uri);
  const ViewLayout views = GetParam().views;
  Random random(3);
  for (int row = 0; row < uri.size.rows; ++row)
    for (int col = 0; col < uri.size.cols; ++col) {
      float& value = flood.mean.at(row, col);
      // 5 % of uniform noise (ten times what a bracket leaves), mirrors that lose up to a third of the light.
      value *= static_cast<float>(1 + 0.1 * (random.uniform() - 0.5));
      const View view = views.view_of(uri.size, row, col);
      value *= 1 - 0.3F * static_cast<float>(view.row + view.col) /
                       static_cast<float>(views.rows + views.cols - 2);
      if (random.uniform() < 0.01) {
        value = 0;
        flood.valid.at(row, col) = 0;
      }
    }
  const auto matched = match_views(flood, views);
  ASSERT_TRUE(matched.ok()) << matched.error().line();
  const auto errors = errors_of(*matched, views, sim::tiled_views(uri.size, views).surface);
  EXPECT_GE(share_right(errors), 0.85);
  EXPECT_GE(share_matched(errors), 0.85);
  for (const float v : matched->surface.values()) ASSERT_TRUE(std::isfinite(v));
}

TEST_P(SimulatedViews, tell_how_large_their_parallax_is) {
  const SceneUri uri = uri_of(GetParam().scene);
  const ViewLayout views = GetParam().views;
  const auto matched = match_views(flood_lit(uri), views);
  const ViewsFound found = judge_views(*matched, views);
  // The simulator shifts by 0.12 · offset · depth, offsets span V − 1, and depth spans 0.53 of a view's width
  // minus the tenth that percentiles leave out. Columns past the neighbour's border (a fifth of the depth at
  // the far side) must be filled in from their surroundings, which can only make the spread smaller.
  const double whole = 0.12 * (views.cols - 1) * 0.53 * 0.9 * uri.size.cols / views.cols;
  EXPECT_LE(found.parallax, whole + 1);
  EXPECT_GE(found.parallax, 0.8 * whole - 1);
  EXPECT_GE(found.confidence, 0.8);
}

TEST(Views, chosen_order_follows_the_parallax) {
  const auto order = [](const std::string& text) {
    const SceneUri uri = uri_of(text);
    const auto split = choose_split(flood_lit(uri), views_of(uri));
    EXPECT_TRUE(split.ok());
    EXPECT_EQ(split->views, views_of(uri));
    EXPECT_TRUE(BlockTree::make(uri.size, *split).ok());
    return split->order;
  };
  EXPECT_EQ(order("sim:vgroove-textured?size=64x64"), SplitOrder::flat);  // one view
  EXPECT_EQ(order("sim:views2?size=40x40"), SplitOrder::views_last);      // parallax of 1.1 pixels
  EXPECT_EQ(order("sim:views2?size=200x200"), SplitOrder::compensated);   // 5.7 pixels
  EXPECT_EQ(order("sim:views3?size=150x150"), SplitOrder::compensated);   // 5.7 pixels
}

TEST(Views, without_anything_in_common_stay_flat) {
  Random random(8);
  Image<float> unrelated(Grid{90, 90});
  for (float& v : unrelated.values()) v = static_cast<float>(random.uniform());
  const auto split = choose_split(exact(unrelated), {3, 3});
  ASSERT_TRUE(split.ok());
  EXPECT_EQ(split->order, SplitOrder::flat);
  const auto blank = choose_split(exact(Image<float>(Grid{90, 90}, 1, 0.3F)), {3, 3});
  ASSERT_TRUE(blank.ok());
  EXPECT_EQ(blank->order, SplitOrder::flat);
}

TEST(Views, an_order_that_is_asked_for_is_taken) {
  const SceneUri uri = uri_of("sim:views2?size=40x40");
  for (const SplitOrder wanted : {SplitOrder::flat, SplitOrder::views_first, SplitOrder::views_last,
                                  SplitOrder::all_at_once, SplitOrder::compensated}) {
    const auto split = choose_split(flood_lit(uri), {2, 2}, wanted);
    ASSERT_TRUE(split.ok());
    EXPECT_EQ(split->order, wanted);
    EXPECT_EQ(split->surface.empty(), wanted != SplitOrder::compensated);
    EXPECT_TRUE(BlockTree::make(uri.size, *split).ok());
  }
}

TEST(Views, of_any_size_are_matched_or_refused_in_words) {
  for (const Grid grid : {Grid{1, 2}, Grid{2, 2}, Grid{5, 97}, Grid{64, 3}}) {
    Random random(1);
    Image<float> picture(grid, 3);
    for (float& v : picture.values()) v = static_cast<float>(random.uniform());
    const auto matched = match_views(exact(picture), {1, 2});
    ASSERT_TRUE(matched.ok()) << to_string(grid);
    for (const float v : matched->surface.values()) EXPECT_TRUE(std::isfinite(v));
  }
  const Radiance flood = exact(Image<float>(Grid{4, 4}, 1, 1.0F));
  EXPECT_EQ(match_views(flood, {5, 1}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(match_views({flood.mean, flood.variance, Image<std::uint8_t>(Grid{4, 3})}, {2, 2}).error().code,
            ErrorCode::size_mismatch);
}

}  // namespace
}  // namespace symrig::views_test
