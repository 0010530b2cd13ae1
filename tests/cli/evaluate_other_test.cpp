// SPDX-License-Identifier: Apache-2.0
// Numbers from few samples carry their error; a scene that the file was not captured from is named.
#include "command.hpp"

#include <algorithm>

namespace symrig::test::evaluate_other_test {
namespace {

using EvaluateOther = CommandTest;
constexpr const char* kOther = "sim:vgroove-textured?size=12x17&noise=off&seed=9";

TEST_F(EvaluateOther, another_scene_is_warned_of_in_one_line) {
  capture_small();
  const Outcome outcome = symrig({"evaluate", "scene.h5", "--rig", kOther, "--json", "e.json"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.err.find("warning"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("seed"), std::string::npos) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1);
  EXPECT_EQ(json("e.json").at("rig_differs").size(), 1U);
}

TEST_F(EvaluateOther, the_same_scene_with_other_noise_is_not) {
  capture_small();
  const Outcome outcome =
      symrig({"evaluate", "scene.h5", "--rig", std::string(kSmall) + "&misalign=0.2", "--json", "e.json"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_TRUE(json("e.json").at("rig_differs").empty());
}

TEST_F(EvaluateOther, errors_of_random_vectors_carry_an_interval) {
  capture_small();
  const Outcome outcome = symrig({"evaluate", "scene.h5", "--rig", kSmall, "--json", "e.json"});
  EXPECT_NE(outcome.out.find("±"), std::string::npos) << outcome.out;
  const nlohmann::json width = json("e.json").at("error_uncertainty");
  EXPECT_EQ(width.at("confidence"), 0.95);
  EXPECT_GT(width.at("frobenius"), 0);
  EXPECT_EQ(width.at("flood"), 0);
}

TEST_F(EvaluateOther, a_capture_tells_how_far_off_its_estimates_may_be) {
  const Outcome outcome =
      symrig({"capture", "--rig", "sim:plane?size=24x24&seed=5", "-o", "p.h5", "--json", "p.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("not given"), std::string::npos) << outcome.out;
  const nlohmann::json j = json("p.json");
  EXPECT_TRUE(j.at("estimated_error").at("indirect").is_null());
  EXPECT_TRUE(j.at("estimated_error_uncertainty").at("indirect").is_null());
  EXPECT_TRUE(j.at("estimated_error_not_given").at("indirect").is_string());
  EXPECT_GT(j.at("estimated_error_uncertainty").at("frobenius"), 0);
  EXPECT_EQ(j.at("error_per_level").size(), j.at("error_per_level_uncertainty").size());
  EXPECT_TRUE(j.at("noise_check").at("findings").empty());
  EXPECT_NEAR(j.at("noise_check").at("variance_ratio").get<double>(), 1, 0.5);
}

}  // namespace
}  // namespace symrig::test::evaluate_other_test
