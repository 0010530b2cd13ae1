// SPDX-License-Identifier: Apache-2.0
#include "bench_runs.hpp"

#include <gtest/gtest.h>

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
