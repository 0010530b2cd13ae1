// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "symrig/image/file.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/view_relight.hpp"

namespace symrig::test::relight_views_test {
namespace {

constexpr Grid kGrid{12, 18};
constexpr ViewLayout kViews{2, 2};

/// A small scene of 2x2 views.
class RelightViews : public CommandTest {
 protected:
  void SetUp() override { capture_small("sim:views2?size=" + to_string(kGrid) + "&noise=off"); }

  Outcome relight_with(std::vector<std::string> options) const {
    std::vector<std::string> arguments{"relight", "scene.h5", "--light", "light.pfm", "-o", "out.pfm"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return symrig(arguments);
  }
  void write_light(Grid grid) const {
    Image<float> light(grid);
    for (std::size_t i = 0; i < light.values().size(); ++i) light.values()[i] = static_cast<float>(i % 7) / 7;
    ASSERT_TRUE(write_image(path("light.pfm"), light).ok());
  }
  /// What the library makes of the same light. PFM holds 32-bit floats: it must agree bit for bit.
  Image<float> expected(const ViewRelight& what) const {
    const StoredScene scene = load_scene(path("scene.h5")).value();
    return relight(scene.tensor, read_image(path("light.pfm")).value(), what).value();
  }
};

TEST_F(RelightViews, one_projector_seen_from_another_view) {
  write_light(kViews.tile(kGrid, {0, 1}).grid);
  const Outcome outcome = relight_with({"--views", "2x2", "--from-view", "0,1", "--to-view", "1,0"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Image<float> picture = read_image(path("out.pfm")).value();
  EXPECT_EQ(picture.grid(), (Grid{6, 9}));
  EXPECT_EQ(picture, expected({kViews, View{0, 1}, View{1, 0}}));
}

TEST_F(RelightViews, all_projectors_seen_from_one_view) {
  write_light(kGrid);
  const Outcome outcome = relight_with({"--views", "2x2", "--to-view", "1,1"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(read_image(path("out.pfm")).value(), expected({kViews, {}, View{1, 1}}));
}

TEST_F(RelightViews, a_light_of_the_wrong_size_is_refused_with_both_sizes) {
  write_light(kGrid);
  const Outcome outcome = relight_with({"--views", "2x2", "--from-view", "0,1"});
  EXPECT_EQ(outcome.code, kBadInput);
  EXPECT_NE(outcome.err.find("12x18"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("6x9"), std::string::npos) << outcome.err;
}

TEST_F(RelightViews, views_that_are_not_there_or_not_written_so_are_usage_errors) {
  write_light(kViews.tile(kGrid, {0, 0}).grid);
  for (const std::vector<std::string>& options :
       std::vector<std::vector<std::string>>{{"--views", "2x2", "--from-view", "0,2"},
                                             {"--views", "2x2", "--to-view", "-1,0"},
                                             {"--views", "2x2", "--from-view", "0"},
                                             {"--views", "2x2", "--from-view", "0,0,0"},
                                             {"--views", "2x2", "--from-view", "a,0"},
                                             {"--views", "2", "--from-view", "0,0"},
                                             {"--views", "13x1", "--from-view", "0,0"},
                                             {"--views", "0x0"},
                                             {"--views", "1x1", "--from-view", "0,0"}}) {
    const Outcome outcome = relight_with(options);
    EXPECT_EQ(outcome.code, kUsage) << options[1];
    EXPECT_FALSE(outcome.err.empty());
  }
}

}  // namespace
}  // namespace symrig::test::relight_views_test
