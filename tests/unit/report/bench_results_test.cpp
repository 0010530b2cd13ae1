// SPDX-License-Identifier: Apache-2.0
// The table, JSON and CSV of a bench.
#include "bench_runs.hpp"

#include <algorithm>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

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
