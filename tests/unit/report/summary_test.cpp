// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/summary.hpp"

#include <array>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace symrig::summary_test {
namespace {

using nlohmann::json;

CaptureResult two_pixels() {
  TensorBuilder builder(BlockTree({1, 2}), 3);
  const std::array<float, 3> colour{1, 2, 3};
  builder.add_scalar(0, 0, colour);
  builder.add_scalar(1, 1, colour);
  builder.add_empty(1, 1, 0);
  return {std::move(builder).finish(), 3, {1, 2}, 0.25};
}

TEST(CaptureJson, keeps_its_promise_key_by_key) {
  CaptureSummary summary;
  summary.scene = "sim:plane?size=1x2";
  summary.noise = "off";
  summary.cost.frames = 12;
  summary.cost.rig_seconds = 4.5;
  summary.measure_seconds = 1.5;
  summary.total_seconds = 2;
  const json j = json::parse(capture_json(summary, two_pixels()));
  EXPECT_EQ(j.at("scene"), "sim:plane?size=1x2");
  EXPECT_EQ(j.at("grid"), json::array({1, 2}));
  EXPECT_EQ(j.at("channels"), 3);
  EXPECT_EQ(j.at("algorithm"), "symrig");
  EXPECT_EQ(j.at("patterns"), 3);
  EXPECT_EQ(j.at("frames"), 12);
  EXPECT_EQ(j.at("patterns_brute_force"), 2);
  EXPECT_EQ(j.at("patterns_per_level"), json::array({1, 2}));
  EXPECT_EQ(j.at("leaves_per_level"),
            json::parse(R"({"rank1":[0,0],"lowrank":[0,0],"empty":[0,1],"scalar":[0,2]})"));
  EXPECT_EQ(j.at("dense_bytes"), 3 * 4 * 4.0);  // channels x pixels squared x bytes
  EXPECT_EQ(j.at("seconds").at("measure"), 1.5);
  EXPECT_EQ(j.at("seconds").at("process"), 0.25);
  EXPECT_EQ(j.at("seconds").at("total"), 2.0);
  EXPECT_EQ(j.at("rig_seconds"), 4.5);
  EXPECT_EQ(j.at("noise"), "off");
  EXPECT_FALSE(j.contains("dual_threshold"));
  EXPECT_EQ(j.at("stopped_by"), "done");
  EXPECT_EQ(j.at("replayed"), 0);
  EXPECT_TRUE(j.at("estimated_error").is_null());
  EXPECT_EQ(j.at("error_per_level"), json::array());
}

TEST(CaptureJson, tells_what_a_budget_ended_and_the_error_then) {
  CaptureResult result = two_pixels();
  result.stopped_by = "max_patterns";
  result.estimated = TransportErrors{.frobenius = 1,
                                     .indirect = 2,
                                     .flood = 3,
                                     .relight_bar = 4,
                                     .relight_random = 5,
                                     .relight_natural = 6,
                                     .bar_indirect = 7};
  result.error_per_level = {0.5, 0.25};
  CaptureSummary summary;
  summary.replayed = 2;
  const json j = json::parse(capture_json(summary, result));
  EXPECT_EQ(j.at("stopped_by"), "max_patterns");
  EXPECT_EQ(j.at("replayed"), 2);
  EXPECT_EQ(j.at("error_per_level"), json::array({0.5, 0.25}));
  const json evaluated = json::parse(evaluation_json("s", "r", &*result.estimated, {}));
  EXPECT_EQ(j.at("estimated_error"), evaluated.at("error"));  // the same keys
}

TEST(Settings, name_each_rule_as_the_json_does) {
  CaptureSettings options;
  options.rule.flood_fraction = 0.1;
  const std::string text = settings_text(options);
  EXPECT_TRUE(text.starts_with("algorithm symrig\n")) << text;
  for (const char* line : {"\nrule.signal_fraction 0.02\n", "\nrule.flood_fraction 0.1\n"})
    EXPECT_NE(text.find(line), std::string::npos) << text;
  CaptureSettings budget = options;
  budget.max_patterns = 5;
  EXPECT_EQ(settings_text(budget), settings_text(options));
  options.algorithm = Algorithm::dual;
  EXPECT_NE(settings_text(options).find("dual_threshold 0.0003\ndual_subtracts false\n"), std::string::npos);
}

TEST(EvaluationJson, keeps_its_promise_key_by_key) {
  const TransportErrors errors{.frobenius = 1,
                               .indirect = 2,
                               .flood = 3,
                               .relight_bar = 4,
                               .relight_random = 5,
                               .relight_natural = 6,
                               .bar_indirect = 7};
  const json j = json::parse(evaluation_json("s", "r", &errors, {}));
  EXPECT_EQ(j.at("error"), json::parse(R"({"frobenius":1.0,"indirect":2.0,"flood":3.0,
                                           "relight":{"bar":4.0,"random":5.0,"natural":6.0},"bar_indirect":7.0})"));
  EXPECT_EQ(j.at("held_out"), json::array());
}

TEST(EvaluationJson, without_truth_has_no_error_key) {
  const json j = json::parse(evaluation_json("s", "", nullptr, {{"p", 0.02, 0.5, 10}}));
  EXPECT_FALSE(j.contains("error"));
  EXPECT_TRUE(j.at("rig").is_null());
  EXPECT_EQ(j.at("held_out").at(0).at("relative"), 0.04);
}

// JSON has no NaN: null is what a script can test for.
TEST(EvaluationJson, what_is_not_a_number_is_null) {
  TransportErrors errors;
  errors.flood = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(json::parse(evaluation_json("s", "r", &errors, {})).at("error").at("flood").is_null());
}

TEST(InspectionJson, tells_what_is_stored) {
  const StoredScene scene{two_pixels().tensor, R"({"scene": "here"})", {}};
  const json j = json::parse(inspection_json(scene));
  EXPECT_EQ(j.at("camera_grid"), json::array({1, 2}));
  EXPECT_EQ(j.at("symmetric"), true);
  EXPECT_EQ(j.at("scalars"), 2);
  EXPECT_EQ(j.at("subdivided_per_level"), json::array({1, 0}));
  EXPECT_EQ(j.at("capture").at("scene"), "here");
  EXPECT_EQ(captured_scene(scene), "here");
}

}  // namespace
}  // namespace symrig::summary_test
