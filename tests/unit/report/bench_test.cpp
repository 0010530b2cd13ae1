// SPDX-License-Identifier: Apache-2.0

#include "symrig/report/bench.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

/// Benches made by hand: no capture is run.
namespace symrig::test {

inline BenchCapture captured(const BenchCase& what, std::int64_t patterns, double indirect,
                             double bar_indirect, double frobenius) {
  BenchCapture capture;
  capture.what = what;
  capture.patterns = patterns;
  capture.frames = 4 * patterns;
  capture.rig_seconds = static_cast<double>(patterns);
  capture.rig_time = {0.75 * capture.rig_seconds, 0.15 * capture.rig_seconds, 0.1 * capture.rig_seconds};
  capture.process_seconds = 0.5;
  capture.merge_seconds = 0.25;
  capture.wall_seconds = 2;
  capture.tensor_bytes = 1000 * patterns;
  capture.error.indirect = indirect;
  capture.error.bar_indirect = bar_indirect;
  capture.error.frobenius = frobenius;
  capture.error.flood = 2 * frobenius;
  return capture;
}

/// One scene, two seeds. Paper takes 400 patterns at its default and leaves 0.01, 0.02, 0.03. symrig's sweep:
/// 100 patterns at 0.1, 0.01, 0.03 and 400 patterns at 0.001, 0.005, 0.003; a capture between them that errs
/// more than both.
inline BenchRun small_run() {
  BenchRun run;
  run.plan.scenes = {"gummy"};
  run.plan.sizes = {{16, 16}};
  run.plan.seeds = {1, 2};
  run.plan.sweeps = {{Algorithm::paper, {3e-4}, 3e-4}, {Algorithm::symrig, {1e-3, 3e-4}, 3e-4}};
  for (const int seed : run.plan.seeds) {
    BenchCase what{.scene = "gummy", .grid = {16, 16}, .seed = seed, .algorithm = Algorithm::paper};
    what.tolerance = 3e-4;
    what.preset = true;
    run.captures.push_back(captured(what, 400, 0.01, 0.02, 0.03));
    what.algorithm = Algorithm::symrig;
    run.captures.push_back(captured(what, 400, 0.001, 0.005, 0.003));
    what.preset = false;
    what.tolerance = 5e-4;
    run.captures.push_back(captured(what, 200, 0.5, 0.5, 0.5));
    what.tolerance = 1e-3;
    run.captures.push_back(captured(what, 100, 0.1, 0.01, 0.03));
  }
  run.planned = run.captures.size();
  return run;
}

}  // namespace symrig::test

namespace symrig::bench_results_test {

namespace {

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) all.push_back(line);
  return all;
}

/// A bench with a capture that failed, with a comma, a quote and a line break in the reason.
BenchRun with_a_failure() {
  BenchRun run = test::small_run();
  run.captures.back().failure = "too \"large\", sorry\nfor that";
  return run;
}

TEST(BenchCsv, has_a_line_of_names_and_one_a_capture) {
  const std::vector<std::string> csv = lines(bench_csv(test::small_run()));
  ASSERT_EQ(csv.size(), 9U);
  const auto fields = [](const std::string& line) { return std::count(line.begin(), line.end(), ',') + 1; };
  for (const std::string& line : csv) EXPECT_EQ(fields(line), 30) << line;
  EXPECT_EQ(csv[1],
            "gummy,16,16,1,camera,1,paper,0.0003,1,400,1600,400,0.75,0.5,0.25,0,2,400000,"
            "0.03,0.01,0.06,0,0,0,0.02,,standard,300,60,40");
}

TEST(BenchCsv, a_failure_leaves_its_numbers_empty_and_its_reason_quoted) {
  const std::string csv = bench_csv(with_a_failure());
  EXPECT_NE(csv.find("gummy,16,16,1,camera,2,symrig,0.001,0,,,,,,,,,,,,,,,,,\"too \"\"large\"\", sorry\nfor "
                     "that\",standard,,,\n"),
            std::string::npos)
      << csv;
}

TEST(BenchJson, tells_captures_and_summary) {
  const nlohmann::json j = nlohmann::json::parse(bench_json(test::small_run()));
  EXPECT_EQ(j.at("command"), "bench");
  EXPECT_EQ(j.at("complete"), true);
  EXPECT_EQ(j.at("captures").size(), 8U);
  const nlohmann::json& first = j.at("captures").at(0);
  EXPECT_EQ(first.at("rig"), "sim:gummy?size=16x16");
  EXPECT_EQ(first.at("algorithm"), "paper");
  EXPECT_EQ(first.at("patterns"), 400);
  EXPECT_EQ(first.at("seconds").at("host"), 0.75);
  EXPECT_EQ(first.at("rig_time"), nlohmann::json({{"light", 300}, {"camera", 60}, {"projector", 40}}));
  EXPECT_EQ(first.at("profile"), "standard");
  EXPECT_EQ(j.at("plan").at("profiles"), nlohmann::json({"standard"}));
  EXPECT_EQ(j.at("summary").at(0).at("profile"), "standard");
  EXPECT_EQ(first.at("error").at("bar_indirect"), 0.02);
  const nlohmann::json& summary = j.at("summary").at(0);
  const nlohmann::json& ratios = summary.at("symrig_over_paper");
  EXPECT_NEAR(ratios.at("patterns_at_indirect").at("geometric_mean").get<double>(), 0.5, 1e-12);
  EXPECT_EQ(ratios.at("patterns_at_bar_indirect").at("reach"), "at_most");
  EXPECT_EQ(summary.at("pairs").size(), 2U);
  EXPECT_EQ(summary.at("flood_over_frobenius").size(), 2U);
  EXPECT_TRUE(j.at("relight").is_null());
}

TEST(BenchJson, marks_what_is_missing) {
  BenchRun run = with_a_failure();
  ++run.planned;
  const nlohmann::json j = nlohmann::json::parse(bench_json(run));
  EXPECT_EQ(j.at("complete"), false);
  EXPECT_EQ(j.at("captures_planned"), 9);
  EXPECT_EQ(j.at("captures").back().count("patterns"), 0U);
  EXPECT_EQ(j.at("captures").back().at("failure"), run.captures.back().failure);
}

TEST(BenchJson, relighting_is_told_beside_memory_speed) {
  BenchRun run = test::small_run();
  run.relight = RelightSpeed{1 << 20, 2'000'000, {1, 1e10, 1e-3}, {2, 2e10, 5e-4}};
  run.relight_of = "sim:gummy?size=16x16, symrig";
  const nlohmann::json j = nlohmann::json::parse(bench_json(run)).at("relight");
  EXPECT_EQ(j.at("tensor"), run.relight_of);
  // 2 MB in a millisecond are 2 GB/s of 10.
  EXPECT_NEAR(j.at("threads").at(0).at("share_of_triad").get<double>(), 0.2, 1e-12);
  EXPECT_NEAR(j.at("threads").at(1).at("share_of_triad").get<double>(), 0.2, 1e-12);
}

TEST(BenchTable, columns_stand_under_their_names) {
  const std::string head = bench_table_head();
  const std::string row = bench_table_row(test::small_run().captures.front());
  EXPECT_EQ(head.size(), row.size());
  const auto ends_at = [](const std::string& text, const std::string& word) {
    return text.find(word) + word.size();
  };
  EXPECT_EQ(ends_at(head, "patterns"), ends_at(row, " 400"));
  EXPECT_EQ(ends_at(head, "indirect"), ends_at(row, "0.0100"));
  EXPECT_EQ(row.find("0.0003*"), head.find("tolerance") + 2);
}

TEST(BenchTable, a_failure_says_why) {
  EXPECT_NE(bench_table_row(with_a_failure().captures.back()).find("failed: too"), std::string::npos);
}

TEST(BenchTable, the_summary_has_the_means_and_what_they_leave_out) {
  BenchRun run = test::small_run();
  run.captures[4].error.indirect = 1e-6;
  const std::string text = bench_summary_text(run);
  EXPECT_NE(text.find("patterns at paper's indirect       0.500 (1 of 2 not reached)"), std::string::npos)
      << text;
  EXPECT_NE(text.find("patterns at paper's bar_indirect   ≤ 0.250"), std::string::npos) << text;
  EXPECT_EQ(text.find("incomplete"), std::string::npos);
  run.planned = 20;
  EXPECT_NE(bench_summary_text(run).find("incomplete: 8 of 20 captures"), std::string::npos);
  EXPECT_EQ(bench_summary_text(BenchRun{}).find("geometric"), std::string::npos);
}

}  // namespace

}  // namespace symrig::bench_results_test

namespace symrig::bench_page_test {

namespace {

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t n = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
  return n;
}

// One scene: three errors over three costs.
TEST(BenchPage, has_a_chart_for_each_scene_error_and_cost) {
  const std::string page = bench_page(test::small_run());
  EXPECT_EQ(count(page, "role=\"img\""), 9U);
  for (const char* error : {"indirect", "bar_indirect", "frobenius"})
    for (const char* cost : {"patterns", "rig seconds", "seconds"})
      EXPECT_EQ(count(page, std::string("gummy: ") + error + " over " + cost), 1U) << error << cost;
}

// Eight captures a chart. The mean over two equal seeds is the capture itself: one line of three points for
// symrig; paper has one tolerance and so no line.
TEST(BenchPage, shows_every_capture_and_one_line_an_algorithm) {
  const std::string page = bench_page(test::small_run());
  EXPECT_EQ(count(page, "<title>symrig"), 9U * 6U);
  EXPECT_EQ(count(page, "<title>paper"), 9U * 2U);
  EXPECT_EQ(count(page, "<polyline"), 9U);
}

TEST(BenchPage, tells_the_ratios) {
  const std::string page = bench_page(test::small_run());
  EXPECT_GT(count(page, "<b>0.500</b>"), 0U);
  EXPECT_GT(count(page, "<b>≤ 0.250</b>"), 0U);
  EXPECT_GT(count(page, "geometric mean"), 0U);
}

// Of 400 s, three quarters are light, 15 % the camera's and a tenth the projector's.
TEST(BenchPage, splits_the_time_of_the_rig) {
  const std::string page = bench_page(test::small_run());
  EXPECT_EQ(count(page, "a 60 Hz projector, and a camera that reads out in 4 ms"), 1U);
  for (const char* part : {"light", "camera", "projector", "host"})  // here, and of every capture
    EXPECT_EQ(count(page, std::string("<th scope=\"col\">") + part + "</th>"), 2U) << part;
  // Both algorithms take 400 patterns at their default: one row each.
  EXPECT_EQ(count(page, "<td>6 min 40 s</td><td>5 min 0 s</td><td>1 min 0 s</td><td>40.0 s</td>"), 2U + 4U);
}

TEST(BenchPage, has_a_summary_for_each_rig) {
  BenchRun run = test::small_run();
  const std::size_t captures = run.captures.size();
  run.plan.profiles = {"screen60", "video"};
  for (std::size_t k = 0; k < captures; ++k) {
    run.captures[k].what.profile = "screen60";
    run.captures.push_back(run.captures[k]);
    run.captures.back().what.profile = "video";
  }
  run.planned = run.captures.size();
  const std::string page = bench_page(run);
  EXPECT_EQ(count(page, "role=\"img\""), 18U);
  EXPECT_GE(count(page, "16x16, video: error against rig seconds"), 1U);
  EXPECT_GE(count(page, "16x16, screen60: error against rig seconds"), 1U);
  EXPECT_EQ(count(page, "<polyline"), 18U);
}

TEST(BenchPage, asks_nobody_for_anything) {
  const std::string page = bench_page(test::small_run());
  for (const char* word : {"http:", "https:", "<script", "<link", "@import", "url(", "src="})
    EXPECT_EQ(count(page, word), 0U) << word;
}

TEST(BenchPage, says_that_it_is_incomplete) {
  BenchRun run = test::small_run();
  EXPECT_EQ(count(bench_page(run), "Incomplete"), 0U);
  run.planned = 20;
  EXPECT_EQ(count(bench_page(run), "Incomplete: the bench was stopped after 8 of 20 captures"), 1U);
}

TEST(BenchPage, a_reason_cannot_become_markup) {
  BenchRun run = test::small_run();
  run.captures.back().failure = "<script>";
  const std::string page = bench_page(run);
  EXPECT_EQ(count(page, "<script"), 0U);
  EXPECT_EQ(count(page, "failed: &lt;script&gt;"), 1U);
}

TEST(BenchPage, of_nothing_is_a_page) {
  EXPECT_GT(count(bench_page(BenchRun{}), "</html>"), 0U);
}

}  // namespace

}  // namespace symrig::bench_page_test

namespace symrig::bench_summary_test {

namespace {

constexpr double kRounding = 1e-12;

void expect_reading(const CurveReading& reading, Reach reach, double value) {
  EXPECT_EQ(reading.reach, reach);
  EXPECT_NEAR(reading.value, value, kRounding);
}

// symrig's envelope goes straight from (100, 0.1) to (400, 0.001): indirect 0.01 is half way, at 200
// patterns, half of paper's 400. Its bar_indirect is below 0.02 from the first capture on: at most 100 of
// 400. At 400 patterns its errors are 0.001 of 0.01 and 0.003 of 0.03.
TEST(BenchSummary, compares_at_equal_error_and_at_equal_patterns) {
  const std::vector<BenchSummary> all = summarize(test::small_run());
  ASSERT_EQ(all.size(), 1U);
  ASSERT_EQ(all.front().pairs.size(), 2U);
  for (const BenchPair& pair : all.front().pairs) {
    EXPECT_EQ(pair.scene, "gummy");
    EXPECT_EQ(pair.paper_patterns, 400);
    expect_reading(pair.patterns_at_indirect, Reach::read, 0.5);
    expect_reading(pair.patterns_at_bar_indirect, Reach::at_most, 0.25);
    expect_reading(pair.patterns_at_both, Reach::read, 0.5);
    expect_reading(pair.indirect_at_patterns, Reach::read, 0.1);
    expect_reading(pair.frobenius_at_patterns, Reach::read, 0.1);
  }
  EXPECT_NEAR(all.front().patterns_at_indirect.value, 0.5, kRounding);
  EXPECT_EQ(all.front().patterns_at_bar_indirect.bounds, 2);
}

// The second seed of paper is better than any capture of symrig: √(0.5) would flatter, so it is said.
TEST(BenchSummary, an_error_that_is_not_reached_is_counted_and_not_averaged) {
  BenchRun run = test::small_run();
  run.captures[4].error.indirect = 1e-6;
  const BenchSummary summary = summarize(run).front();
  EXPECT_EQ(summary.pairs[1].patterns_at_indirect.reach, Reach::not_reached);
  EXPECT_EQ(summary.patterns_at_indirect.averaged, 1);
  EXPECT_EQ(summary.patterns_at_indirect.not_reached, 1);
  EXPECT_EQ(summary.patterns_at_indirect.reach(), Reach::not_reached);
}

TEST(BenchSummary, seeds_are_compared_with_themselves) {
  BenchRun run = test::small_run();
  run.captures[4].patterns = 200;  // paper, seed 2
  const BenchSummary summary = summarize(run).front();
  expect_reading(summary.pairs[0].patterns_at_indirect, Reach::read, 0.5);
  expect_reading(summary.pairs[1].patterns_at_indirect, Reach::read, 1);
  // √(0.5 · 1)
  EXPECT_NEAR(summary.patterns_at_indirect.value, std::sqrt(0.5), kRounding);
}

TEST(BenchSummary, captures_that_failed_take_no_part) {
  BenchRun run = test::small_run();
  run.captures[0].failure = "the lamp is off";  // paper, seed 1
  const BenchSummary summary = summarize(run).front();
  ASSERT_EQ(summary.pairs.size(), 1U);
  EXPECT_EQ(summary.pairs.front().seed, 2);
}

TEST(BenchSummary, without_both_algorithms_there_is_nothing_to_compare) {
  BenchRun run = test::small_run();
  std::erase_if(run.captures, [](const BenchCapture& c) { return c.what.algorithm == Algorithm::paper; });
  const BenchSummary summary = summarize(run).front();
  EXPECT_TRUE(summary.pairs.empty());
  EXPECT_EQ(summary.patterns_at_indirect.averaged, 0);
  EXPECT_EQ(summarize(BenchRun{}).size(), 0U);
}

// flood is twice frobenius in every capture by hand; one is made worse.
TEST(BenchSummary, flood_bias_is_the_worst_over_seeds_and_sweep) {
  BenchRun run = test::small_run();
  run.captures[5].error.flood = 0.009;  // symrig, seed 2, default tolerance: 3 × frobenius
  run.captures[6].error.flood = 2.5;    // the same, another tolerance: 5 × frobenius
  const BenchSummary summary = summarize(run).front();
  for (const FloodBias& bias : summary.flood) {
    const bool symrig = bias.algorithm == Algorithm::symrig;
    EXPECT_NEAR(bias.at_preset, symrig ? 3 : 2, kRounding);
    EXPECT_NEAR(bias.worst, symrig ? 5 : 2, kRounding);
  }
}

}  // namespace

}  // namespace symrig::bench_summary_test

namespace symrig::bench_cases_test {

namespace {

BenchPlan small_plan() {
  BenchPlan plan;
  plan.scenes = {"gummy", "plane"};
  plan.sizes = {{16, 16}, {80, 60}};
  plan.seeds = {1, 2};
  plan.sweeps = {{Algorithm::paper, {1e-3}, 3e-4},
                 {Algorithm::symrig, {1e-4, 1e-2, 1e-4}, 3e-4},
                 {Algorithm::brute, {}, 0}};
  return plan;
}

// 2 scenes × 2 seeds × (paper: 1e-3 and its preset; symrig: 1e-2, 1e-4; brute once) = 20 on the small grid;
// the large one has 4,800 pixels, too many for brute force: 16.
TEST(BenchCases, are_every_combination_once) {
  const std::vector<BenchCase> cases = bench_cases(small_plan());
  EXPECT_EQ(cases.size(), 36U);
  for (auto one = cases.begin(); one != cases.end(); ++one)
    EXPECT_EQ(std::count(cases.begin(), cases.end(), *one), 1);
}

// Every rig runs the same captures.
TEST(BenchCases, are_the_same_on_every_rig) {
  BenchPlan plan = small_plan();
  plan.profiles = {"screen60", "video"};
  const std::vector<BenchCase> cases = bench_cases(plan);
  ASSERT_EQ(cases.size(), 72U);
  for (std::size_t k = 0; k < 36; ++k) {
    BenchCase other = cases[k];
    EXPECT_EQ(other.profile, "screen60");
    other.profile = "video";
    EXPECT_EQ(cases[k + 36], other);
  }
  EXPECT_EQ(bench_rig(plan, cases[40]).find("&profile=video") == std::string::npos, false);
}

TEST(BenchCases, brute_force_stays_on_small_grids) {
  const auto brute_on = [](Grid grid) {
    const std::vector<BenchCase> cases = bench_cases(small_plan());
    return std::count_if(cases.begin(), cases.end(), [grid](const BenchCase& c) {
      return c.algorithm == Algorithm::brute && c.grid == grid;
    });
  };
  EXPECT_EQ(brute_on({16, 16}), 4);
  EXPECT_EQ(brute_on({80, 60}), 0);
}

TEST(BenchCases, go_from_loose_to_tight_and_hold_the_reference) {
  const std::vector<BenchCase> cases = bench_cases(small_plan());
  const std::vector<BenchCase> first(cases.begin(), cases.begin() + 5);
  const BenchCase like{.scene = "gummy", .grid = {16, 16}, .seed = 1};
  const auto expected = [&like](Algorithm algorithm, std::optional<double> tolerance, bool preset) {
    BenchCase one = like;
    one.algorithm = algorithm;
    one.tolerance = tolerance;
    one.preset = preset;
    return one;
  };
  EXPECT_EQ(first[0], expected(Algorithm::paper, 1e-3, false));
  EXPECT_EQ(first[1],
            expected(Algorithm::paper, 3e-4, true));  // not asked for, but the summary is read there
  EXPECT_EQ(first[2], expected(Algorithm::symrig, 1e-2, false));
  EXPECT_EQ(first[3], expected(Algorithm::symrig, 1e-4, false));
  EXPECT_EQ(first[4], expected(Algorithm::brute, {}, true));
}

TEST(BenchCases, name_the_rig_they_run_on) {
  BenchPlan plan = small_plan();
  plan.camera_noise = false;
  plan.channels = 3;
  EXPECT_EQ(bench_rig(plan, {.scene = "gummy", .grid = {80, 60}, .seed = 2}),
            "sim:gummy?size=80x60&seed=2&channels=3&noise=off");
}

}  // namespace

}  // namespace symrig::bench_cases_test
