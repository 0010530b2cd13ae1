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

// One scene: three errors over two costs.
TEST(BenchPage, has_a_chart_for_each_scene_error_and_cost) {
  const std::string page = bench_page(test::small_run());
  EXPECT_EQ(count(page, "role=\"img\""), 6U);
  for (const char* error : {"indirect", "bar_indirect", "frobenius"})
    for (const char* cost : {"patterns", "seconds"})
      EXPECT_EQ(count(page, std::string("gummy: ") + error + " over " + cost), 1U) << error << cost;
}

// Eight captures a chart. The mean over two equal seeds is the capture itself: one line of three points for
// symrig; paper has one tolerance and so no line.
TEST(BenchPage, shows_every_capture_and_one_line_an_algorithm) {
  const std::string page = bench_page(test::small_run());
  EXPECT_EQ(count(page, "<title>symrig"), 6U * 6U);
  EXPECT_EQ(count(page, "<title>paper"), 6U * 2U);
  EXPECT_EQ(count(page, "<polyline"), 6U);
}

TEST(BenchPage, tells_the_ratios) {
  const std::string page = bench_page(test::small_run());
  EXPECT_GT(count(page, "<b>0.500</b>"), 0U);
  EXPECT_GT(count(page, "<b>≤ 0.250</b>"), 0U);
  EXPECT_GT(count(page, "geometric mean"), 0U);
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
