// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/forecasts.hpp"

#include <span>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::search_forecast_test {
namespace {

constexpr double kDirect = 0.05;

/// The plan looks at `children`: they have to outlive it.
LevelPlan plan(int level, std::int64_t planned, std::span<const double> children, std::int64_t before = 0) {
  return {.level = level, .planned = planned, .before = before, .children = children};
}

TEST(SearchForecast, nothing_is_known_before_level_1_and_where_blocks_share_nothing) {
  const std::vector<double> children(6, 4.0);
  EXPECT_FALSE(forecast_later(plan(0, 4, children)).known());
  EXPECT_TRUE(forecast_later(plan(1, 16, children)).known());
  EXPECT_FALSE(forecast_later(plan(3, 256, children)).known());  // every block by itself
  EXPECT_FALSE(forecast_later(plan(6, 40, children)).known());
  EXPECT_FALSE(forecast_later({}).known());
}

TEST(SearchForecast, after_the_last_level_only_the_direct_light_is_left) {
  const std::vector<double> children(6, 4.0);
  LevelPlan last = plan(5, 64, children, 44);
  last.taken = 200;
  last.direct_share = kDirect;
  EXPECT_EQ(forecast_later(last).least, 0);
  EXPECT_EQ(forecast_later(last).most, 10);
}

TEST(SearchForecast, blocks_of_few_pixels_have_fewer_children_to_light) {
  const std::vector<double> all_four(6, 4.0), near_pixels{4, 4, 4, 4, 3, 1.25};
  const auto whole = forecast_later(plan(3, 40, all_four, 40));
  const auto few = forecast_later(plan(3, 40, near_pixels, 40));
  EXPECT_LT(few.least, whole.least);
  EXPECT_LT(few.most, whole.most);
  EXPECT_GT(few.least, 0);
}

// A growth that was seen to be small narrows what may come; a large one does not widen it for ever.
TEST(SearchForecast, learns_from_the_level_before) {
  const std::vector<double> children(8, 4.0);
  const auto calm = forecast_later(plan(4, 40, children, 40));
  const auto steep = forecast_later(plan(4, 40, children, 10));
  EXPECT_EQ(calm.least, steep.least);
  EXPECT_LT(calm.most, steep.most);
}

}  // namespace
}  // namespace symrig::acquisition::search_forecast_test
