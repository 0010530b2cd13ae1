// SPDX-License-Identifier: Apache-2.0
#include "report/search_steps.hpp"

#include <gtest/gtest.h>

namespace symrig::report::search_steps_test {
namespace {

std::vector<Stage> stages(const char* json) {
  return stages_of(CaptureFacts(json));
}

const Stage& named(const std::vector<Stage>& all, const std::string& name) {
  for (const Stage& stage : all)
    if (stage.name == name) return stage;
  ADD_FAILURE() << name;
  return all.front();
}

// The first entry of patterns_per_level is what was taken before the levels; the first error is that of level
// 0.
TEST(SearchSteps, an_error_stands_beside_the_photographs_of_its_level) {
  for (
      const char* json :
      {R"({"patterns": 40, "rig_seconds": 80, "patterns_per_level": [7, 4, 16, 13], "error_per_level": [0.5, 0.25]})",
       R"({"patterns": 40, "rig_seconds": 80, "patterns_per_level": [7, 4, 16, 13], "error_per_level": [0.5, 0.25],
            "steps": [{"level": 0, "patterns": 11, "rig_seconds": 22, "error": 0.5},
                      {"level": 1, "patterns": 27, "rig_seconds": 54, "error": 0.25}]})"}) {
    const auto all = stages(json);
    ASSERT_EQ(all.size(), 4U) << json;
    EXPECT_FALSE(all[0].error);
    EXPECT_EQ(all[0].by_then->value, 7);
    EXPECT_EQ(named(all, "level 0").error->value, 0.5);
    EXPECT_EQ(named(all, "level 0").by_then->value, 11);
    EXPECT_EQ(named(all, "level 1").error->value, 0.25);
    EXPECT_EQ(named(all, "level 1").by_then->value, 27);
    EXPECT_DOUBLE_EQ(named(all, "level 1").rig_seconds->value, 54);
    EXPECT_EQ(named(all, "finished").patterns->value, 13);
  }
}

TEST(SearchSteps, seconds_that_the_file_does_not_tell_are_marked) {
  const auto all = stages(
      R"({"patterns": 10, "rig_seconds": 20, "patterns_per_level": [7, 3], "error_per_level": [0.5]})");
  EXPECT_TRUE(named(all, "level 0").seconds_scaled);
  EXPECT_FALSE(named(all, "finished").seconds_scaled);
}

// Leaves that were split later add errors, but no entry of patterns_per_level: nobody can say whose they are.
TEST(SearchSteps, errors_that_belong_to_no_level_are_left_out) {
  const auto all = stages(
      R"({"patterns": 30, "patterns_per_level": [7, 4, 19], "error_per_level": [0.5, 0.4, 0.3, 0.2]})");
  for (const Stage& stage : all) EXPECT_FALSE(stage.error) << stage.name;
}

TEST(SearchSteps, a_level_that_comes_again_is_told_apart) {
  const auto all =
      stages(R"({"patterns_per_level": [7, 4, 9], "steps": [{"level": 0, "patterns": 11, "error": 0.5},
      {"level": 1, "patterns": 15, "error": 0.4}, {"level": 1, "patterns": 20, "error": 0.3}]})");
  EXPECT_EQ(named(all, "level 1").error->value, 0.4);
  EXPECT_EQ(named(all, "level 1 again").error->value, 0.3);
  EXPECT_EQ(named(all, "level 1 again").patterns->value, 5);
}

TEST(SearchSteps, baselines_have_rounds) {
  const auto all = stages(
      R"({"algorithm": "dual", "patterns": 10, "patterns_per_level": [1, 4, 5], "error_per_level": []})");
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(named(all, "round 3").by_then->value, 10);
}

}  // namespace
}  // namespace symrig::report::search_steps_test
