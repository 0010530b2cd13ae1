// SPDX-License-Identifier: Apache-2.0
#include "report/html.hpp"

#include "symrig/report/html_report.hpp"

#include <array>

#include <gtest/gtest.h>

namespace symrig::report::html_test {
namespace {

TEST(Text, numbers_for_people) {
  EXPECT_EQ(grouped(0), "0");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1000), "1,000");
  EXPECT_EQ(grouped(-1234567), "-1,234,567");
  EXPECT_EQ(short_number(0.0012345), "0.00123");
  EXPECT_EQ(short_number(123.456), "123");
  EXPECT_EQ(short_number(4.56e-7), "4.56e-07");
  EXPECT_EQ(percent(0), "0 %");
  EXPECT_EQ(percent(0.0012), "0.12 %");
  EXPECT_EQ(percent(0.9961), "99.6 %");
  EXPECT_EQ(percent(1), "100.0 %");
  EXPECT_EQ(percent(1e-9), "1.0e-07 %");
  EXPECT_EQ(byte_size(999), "999 bytes");
  EXPECT_EQ(byte_size(12'345'678), "12.3 MB");
  EXPECT_EQ(byte_size(4.7e10), "47.0 GB");
  EXPECT_EQ(duration(0.0012), "1.2 ms");
  EXPECT_EQ(duration(0.5), "500 ms");
  EXPECT_EQ(duration(59.94), "59.9 s");
  EXPECT_EQ(duration(245), "4 min 5 s");
  EXPECT_EQ(duration(3600 * 3 + 60 * 20), "3 h 20 min");
  EXPECT_EQ(duration(86400 * 3 + 3600 * 2), "3 days 2 h");
  EXPECT_EQ(duration(1e300), "1.00e+300 s");  // more than any count of days
  EXPECT_EQ(grouped(1e300), "1.00e+300");
}

TEST(Html, text_cannot_become_markup) {
  EXPECT_EQ(escape("<b a=\"1\">&'"), "&lt;b a=&quot;1&quot;&gt;&amp;&#39;");
}

/// T = 1 on the diagonal of a grid.
StoredScene identity(Grid grid) {
  TensorBuilder builder(BlockTree(grid), 1);
  const std::array<float, 1> one{1};
  for (std::int32_t i = 0; i < grid.size(); ++i) builder.add_scalar(i, i, one);
  return {std::move(builder).finish(), "{}", {}};
}

TEST(HtmlReport, tells_the_captures_own_estimate_and_its_budget) {
  StoredScene scene = identity({4, 4});
  scene.capture_json =
      R"({"patterns_per_level": [1, 2, 3], "error_per_level": [0.5, 0.25], "stopped_by": "max_<b>",
          "estimated_error": {"frobenius": 0.125, "relight": {"bar": 0.031}}})";
  const auto page = html_report(scene, {.title = "budget"});
  ASSERT_TRUE(page.ok());
  for (const char* words :
       {"estimated by the capture", ">12.5\xC2\xA0%</data></td>", ">3.1\xC2\xA0%</data></td>",
        "Stopped early", "max_&lt;b&gt;", "estimated error at the end of this stage",
        ">50.0\xC2\xA0%</data></td>", ">25.0\xC2\xA0%</data></td>"})
    EXPECT_NE(page->find(words), std::string::npos) << words;
  EXPECT_EQ(html_report(identity({4, 4}), {.title = "none"})->find("estimated by"), std::string::npos);
}

// What a file says about itself is shown, never obeyed.
TEST(HtmlReport, a_hostile_file_stays_text) {
  StoredScene scene = identity({4, 4});
  scene.capture_json =
      R"({"scene": "<script>alert(1)</script>", "patterns": "many", "patterns_per_level": 3})";
  scene.held_out.push_back({"<img src=x>", Image<float>({4, 4}, 1, 1.0F), Image<float>({4, 4}, 1, 1.0F)});
  const auto page = html_report(scene, {.title = "<h1>"});
  ASSERT_TRUE(page.ok());
  EXPECT_EQ(page->find("<script"), std::string::npos);
  EXPECT_EQ(page->find("<img src=x>"), std::string::npos);
  EXPECT_NE(page->find("&lt;script&gt;"), std::string::npos);
}

TEST(HtmlReport, broken_capture_json_leaves_gaps_not_errors) {
  StoredScene scene = identity({3, 5});
  for (const char* json : {"", "null", "[1,2]", "{\"seconds\": 3", "{\"seconds\": [1]}"}) {
    scene.capture_json = json;
    EXPECT_TRUE(html_report(scene, {.title = "t"}).ok()) << json;
  }
}

// Truth that equals the tensor: every error is exactly zero, and the page says so.
TEST(HtmlReport, compares_with_truth_where_it_is_given) {
  const StoredScene scene = identity({6, 8});
  const auto page = html_report(scene, {.title = "t", .truth = [&](const Image<float>& pattern) {
                                          return scene.tensor.apply(pattern);
                                        }});
  ASSERT_TRUE(page.ok());
  EXPECT_NE(page->find("Ground truth"), std::string::npos);
  EXPECT_NE(page->find("data-from=\"evaluate:/error/frobenius\">0\xC2\xA0%</data>"), std::string::npos);
  const auto alone = html_report(scene, {.title = "t", .no_truth = "because"});
  EXPECT_NE(alone->find("is not known. because"), std::string::npos);
  EXPECT_EQ(alone->find("Ground truth"), std::string::npos);
}

TEST(HtmlReport, stops_when_asked_and_passes_errors_on) {
  const StoredScene scene = identity({4, 4});
  const auto stopped =
      html_report(scene, {.title = "t", .progress = [](const ProgressEvent&) { return false; }});
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::interrupted);
  const auto failed =
      html_report(scene, {.title = "t", .truth = [](const Image<float>&) -> Result<Image<float>> {
                            return Error{ErrorCode::device_lost, "gone"};
                          }});
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::device_lost);
}

}  // namespace
}  // namespace symrig::report::html_test
