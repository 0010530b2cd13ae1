// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"

#include <algorithm>

namespace symrig::test::evaluate_test {
namespace {

using Evaluate = CommandTest;
using Inspect = CommandTest;

TEST_F(Evaluate, writes_the_promised_keys) {
  capture_small();
  const Outcome outcome = symrig({"evaluate", "scene.h5", "--rig", kSmall, "--json", "e.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const nlohmann::json error = json("e.json").at("error");
  for (const char* key : {"frobenius", "indirect", "flood", "bar_indirect"})
    EXPECT_TRUE(error.at(key).is_number()) << key;
  for (const char* key : {"bar", "random", "natural"})
    EXPECT_TRUE(error.at("relight").at(key).is_number()) << key;
  EXPECT_EQ(json("e.json").at("rig"), kSmall);
  EXPECT_EQ(json("e.json").at("scene"), kSmall);
}

// Brute force without noise measures every entry of T through 12-bit frames merged from four exposures. The
// shortest exposure sets the scale; rounding to one code of the longest that does not saturate, ratio 8
// apart, costs at most half a code of 512, a sample, and entries average it: 1 % of T is far above it.
// Another scene's T is off by its size.
TEST_F(Evaluate, tells_a_right_tensor_from_a_wrong_one) {
  ASSERT_EQ(symrig({"capture", "--rig", kSmall, "-o", "scene.h5", "--algorithm", "brute"}).code, 0);
  const auto frobenius = [&](const std::string& rig) {
    EXPECT_EQ(symrig({"evaluate", "scene.h5", "--rig", rig, "--json", "e.json"}).code, 0);
    return json("e.json").at("error").at("frobenius").get<double>();
  };
  EXPECT_LT(frobenius(kSmall), 0.01);
  EXPECT_GT(frobenius("sim:vgroove-textured?size=12x17&noise=off&seed=9"), 0.1);
}

TEST_F(Evaluate, a_rig_of_another_size_is_refused_with_both_sizes) {
  capture_small();
  expect_refusal({"evaluate", "scene.h5", "--rig", "sim:vgroove-textured?size=12x18"}, kBadInput,
                 {"12x18", "12x17"});
  expect_refusal({"evaluate", "scene.h5", "--rig", "sim:vgroove-textured?size=12x17&channels=3"}, kBadInput,
                 {"channels"});
}

TEST_F(Evaluate, without_truth_or_photographs_it_says_what_to_give) {
  // The paper's algorithm holds nothing out.
  ASSERT_EQ(symrig({"capture", "--rig", kSmall, "--algorithm", "paper", "-o", "scene.h5"}).code, 0);
  expect_refusal({"evaluate", "scene.h5"}, kUsage, {"--rig"});
}

TEST_F(Evaluate, held_out_photographs_are_one_line) {
  capture_small();
  const Outcome outcome = symrig({"evaluate", "scene.h5", "--json", "e.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(std::ranges::count(outcome.out, '\n'), 1) << outcome.out;
  const nlohmann::json held_out = json("e.json").at("held_out");
  EXPECT_TRUE(
      outcome.out.starts_with(std::to_string(held_out.size()) + " held-out photographs; the worst, '"))
      << outcome.out;
}

TEST_F(Evaluate, bad_input_is_refused) {
  expect_refusal({"evaluate", "none.h5", "--rig", kSmall}, kBadInput, {"none.h5"});
  capture_small();
  expect_refusal({"evaluate", "scene.h5", "--rig", "sim:nothing"}, kUsage, {"nothing"});
  expect_refusal({"evaluate", "scene.h5", "--rig", kSmall, "--json", "missing/e.json"}, kBadInput,
                 {"missing/e.json"});
}

TEST_F(Inspect, tells_levels_leaves_ranks_and_bytes) {
  capture_small();
  const Outcome outcome = symrig({"inspect", "scene.h5", "--json", "i.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("12x17"), std::string::npos);
  EXPECT_NE(outcome.out.find(kSmall), std::string::npos);
  const nlohmann::json j = json("i.json");
  EXPECT_EQ(j.at("camera_grid"), nlohmann::json::array({12, 17}));
  EXPECT_EQ(j.at("projector_grid"), nlohmann::json::array({12, 17}));
  EXPECT_EQ(j.at("symmetric"), true);
  EXPECT_EQ(j.at("levels"), 6);
  EXPECT_EQ(j.at("leaves_per_level").at("rank1").size(), 6U);
  EXPECT_EQ(j.at("dense_bytes"), 4.0 * 204 * 204);
  EXPECT_EQ(j.at("capture").at("scene"), kSmall);
  EXPECT_EQ(j.at("held_out").get<int>() % 4, 2);  // six, and further sets of four
}

TEST_F(Inspect, bad_input_is_refused) {
  expect_refusal({"inspect", "none.h5"}, kBadInput, {"none.h5"});
  expect_refusal({"inspect", "."}, kBadInput, {"."});
  write_text(path("text.h5"), "hello");
  expect_refusal({"inspect", "text.h5"}, kBadInput, {"text.h5"});
  capture_small();
  expect_refusal({"inspect", "scene.h5", "--json", "missing/i.json"}, kBadInput, {"missing/i.json"});
}

// Numbers from few samples carry their error; a scene that the file was not captured from is named.

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
}  // namespace symrig::test::evaluate_test
