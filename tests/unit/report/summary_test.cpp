// SPDX-License-Identifier: Apache-2.0

#include "symrig/report/summary.hpp"

#include "report/sections.hpp"
#include "symrig/report/text.hpp"

#include <algorithm>
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

namespace symrig::held_out_test {

namespace {

/// T = 2 on the diagonal of a 2 x 4 grid, except that the last camera pixel sees nothing.
TransportTensor seven_lit() {
  TensorBuilder builder(BlockTree({2, 4}), 1);
  const BlockTree tree({2, 4});
  const std::array<float, 1> two{2};
  for (std::int32_t i = 0; i < 8; ++i)
    if (tree.order()[i] != 7) builder.add_scalar(i, i, two);
  return std::move(builder).finish();
}

// By hand: the prediction of a pattern of ones is 2 on seven pixels. The photograph is off by 0.5 there and
// by 100 on the pixel that is not lit, which must not count.
TEST(HeldOutError, is_the_rms_over_lit_pixels) {
  HeldOut held_out{"name", Image<float>({2, 4}, 1, 1.0F), Image<float>({2, 4}, 1, 2.5F)};
  held_out.photograph.at(1, 3) = 100;
  const auto error = held_out_error(seven_lit(), held_out);
  ASSERT_TRUE(error.ok());
  EXPECT_EQ(error->name, "name");
  EXPECT_EQ(error->lit_pixels, 7);
  EXPECT_DOUBLE_EQ(error->rms, 0.5);
  EXPECT_DOUBLE_EQ(error->mean_white, 2);
  EXPECT_DOUBLE_EQ(error->relative(), 0.25);
}

TEST(HeldOutError, a_photograph_of_another_size_is_refused) {
  const auto error = held_out_error(seven_lit(), {"n", Image<float>({2, 4}), Image<float>({4, 2})});
  ASSERT_FALSE(error.ok());
  EXPECT_EQ(error.error().code, ErrorCode::size_mismatch);
}

TEST(HeldOutError, a_dark_scene_has_no_error_to_tell) {
  TensorBuilder builder(BlockTree({2, 2}), 1);
  const auto error =
      held_out_error(std::move(builder).finish(), {"n", Image<float>({2, 2}), Image<float>({2, 2}, 1, 1.0F)});
  ASSERT_TRUE(error.ok());
  EXPECT_EQ(error->lit_pixels, 0);
  EXPECT_EQ(error->relative(), 0);
}

}  // namespace

}  // namespace symrig::held_out_test

namespace symrig::node_counts_test {

namespace {

constexpr std::array<float, 16> kOnes{1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};

// A 2 x 2 grid: the root splits into four pixels, ten unordered pairs. By hand: four on the diagonal as
// scalars, five off it as scalars, one empty.
TEST(NodeCounts, of_a_tensor_drawn_by_hand) {
  TensorBuilder builder(BlockTree({2, 2}), 1);
  const std::array<float, 1> one{1};
  for (int i = 0; i < 4; ++i) builder.add_scalar(i, i, one);
  builder.add_empty(1, 3, 0);
  for (const auto& [i, j] : {std::pair{1, 0}, {2, 0}, {2, 1}, {3, 1}, {3, 2}}) builder.add_scalar(i, j, one);
  const std::vector<NodeCounts> counts = node_counts(std::move(builder).finish());
  ASSERT_EQ(counts.size(), 2U);
  EXPECT_EQ(counts[0].subdivided, 1);
  EXPECT_EQ(counts[0].total(), 1);
  EXPECT_EQ(counts[1].leaves.scalar, 9);
  EXPECT_EQ(counts[1].leaves.empty, 1);
  EXPECT_EQ(counts[1].subdivided, 0);
  EXPECT_EQ(counts[1].total(), 10);
}

TEST(NodeCounts, a_tensor_of_one_leaf_is_not_subdivided) {
  TensorBuilder builder(BlockTree({2, 4}), 1);
  builder.add_leaf(0, 8, 0, 8, 1, 0, kOnes);
  const std::vector<NodeCounts> counts = node_counts(std::move(builder).finish());
  EXPECT_EQ(counts[0].leaves.rank1, 1);
  for (const NodeCounts& level : counts) EXPECT_EQ(level.subdivided, 0);
}

// The order of the two blocks of a leaf does not matter: both halves of T are the same nodes.
TEST(NodeCounts, mirror_images_are_one_node) {
  const BlockTree tree({4, 4});
  const auto blocks = tree.level(1);
  TensorBuilder builder(tree, 1);
  const std::array<float, 1> one{1};
  builder.add_scalar(blocks[0].begin, blocks[1].begin, one);
  builder.add_scalar(blocks[1].begin + 1, blocks[0].begin + 1, one);
  const std::vector<NodeCounts> counts = node_counts(std::move(builder).finish());
  ASSERT_EQ(counts.size(), 3U);
  EXPECT_EQ(counts[2].leaves.scalar, 2);
  EXPECT_EQ(counts[1].subdivided, 1);
  EXPECT_EQ(counts[0].subdivided, 1);
}

}  // namespace

}  // namespace symrig::node_counts_test

namespace symrig::provenance_test {

namespace {

constexpr const char* kFile = "sim:vgroove-textured?size=12x17&seed=2";

TEST(Provenance, the_same_scene_may_be_photographed_in_other_ways) {
  EXPECT_TRUE(differences_of_scene(kFile, kFile).empty());
  for (const char* keys : {"&noise=off", "&misalign=0.3", "&flare=0.1", "&dead=0.1", "&exposures=2",
                           "&drift=0.1", "&gamma=2", "&light=0.5", "&black=0.01"})
    EXPECT_TRUE(differences_of_scene(kFile, std::string(kFile) + keys).empty()) << keys;
  // No texture: the seed is that of the noise.
  EXPECT_TRUE(
      differences_of_scene("sim:vgroove-white?size=12x17", "sim:vgroove-white?size=12x17&seed=5").empty());
}

TEST(Provenance, what_makes_it_another_scene_is_named) {
  const auto one = [](const std::string& rig) {
    const auto all = differences_of_scene(kFile, rig);
    EXPECT_EQ(all.size(), 1U) << rig;
    return all.empty() ? std::string() : all[0];
  };
  EXPECT_NE(one("sim:vgroove-textured?size=12x17&seed=3").find("seed"), std::string::npos);
  EXPECT_NE(one("sim:gummy?size=12x17&seed=2").find("gummy"), std::string::npos);
  EXPECT_NE(one("sim:vgroove-textured?size=12x17&seed=2&psf=0.1").find("psf"), std::string::npos);
  EXPECT_NE(one("sim:vgroove-textured?size=12x17&seed=2&indirect=0.5").find("indirect"), std::string::npos);
  EXPECT_NE(one("sim:vgroove-textured?size=12x18&seed=2").find("12x18"), std::string::npos);
  EXPECT_NE(one("a bench").find("a bench"), std::string::npos);
}

TEST(Provenance, a_file_that_does_not_say_is_not_doubted) {
  EXPECT_TRUE(differences_of_scene("", kFile).empty());
}

}  // namespace

}  // namespace symrig::provenance_test

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

namespace symrig::letters_test {

namespace {

double mean(const Image<float>& image) {
  double sum = 0;
  for (const float v : image.values()) sum += v;
  return sum / static_cast<double>(image.values().size());
}

TEST(Letters, are_a_pattern_on_any_grid) {
  for (const Grid grid :
       {Grid{1, 1}, Grid{1, 9}, Grid{9, 1}, Grid{12, 17}, Grid{310, 350}, Grid{40, 400}, Grid{400, 40}}) {
    const Image<float> picture = letters_pattern(grid);
    ASSERT_EQ(picture.grid(), grid);
    ASSERT_EQ(picture.channels(), 1);
    for (const float v : picture.values()) {
      EXPECT_GE(v, 0);
      EXPECT_LE(v, 1);
    }
    EXPECT_GT(mean(picture), 0) << to_string(grid);
  }
}

// Two lines of three letters take 17 x 19 cells with their margins.
TEST(Letters, on_the_grid_of_their_cells_are_black_and_white) {
  const Image<float> picture = letters_pattern({17, 19});
  for (const float v : picture.values()) EXPECT_TRUE(v == 0.0F || v == 1.0F) << v;
  // The top stroke of S: cells 2 to 5 of the second row; its first cell is empty.
  EXPECT_EQ(picture.at(1, 1), 0.0F);
  EXPECT_EQ(picture.at(1, 2), 1.0F);
  EXPECT_EQ(picture.at(1, 5), 1.0F);
  // The margin.
  for (int col = 0; col < 19; ++col) EXPECT_EQ(picture.at(0, col) + picture.at(16, col), 0.0F);
}

TEST(Letters, stand_on_one_line_where_the_grid_is_wide) {
  const Image<float> picture = letters_pattern({9, 37});  // 6 letters of 6 cells and a margin
  for (const float v : picture.values()) EXPECT_TRUE(v == 0.0F || v == 1.0F) << v;
  EXPECT_EQ(picture.at(1, 1), 0.0F);   // S is open at the left of its first row
  EXPECT_EQ(picture.at(7, 31), 0.0F);  // so is G at its last
  EXPECT_EQ(picture.at(7, 35), 1.0F);
}

// Covered shares add up: twice the cells a side, four times the ink.
TEST(Letters, keep_their_share_of_ink_at_any_size) {
  EXPECT_NEAR(mean(letters_pattern({17, 19})), mean(letters_pattern({170, 190})), 1e-6);
  EXPECT_NEAR(mean(letters_pattern({17, 19})), mean(letters_pattern({51, 57})),
              0.02);  // coverage sampled 8 x 8
}

}  // namespace

}  // namespace symrig::letters_test
