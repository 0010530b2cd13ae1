// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "symrig/acquisition/algorithms.hpp"

namespace symrig::test::report_test {
namespace {

using Report = CommandTest;

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t n = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
  return n;
}

/// Nothing on the page asks anybody for anything: every src is a data URI, no link, no script, no style from
/// elsewhere.
void expect_self_contained(const std::string& page) {
  EXPECT_EQ(count(page, "src=\""), count(page, "src=\"data:image/png;base64,"));
  for (const char* word : {"http:", "https:", "<script", "<link", "@import", "url(", "onload", "<iframe"})
    EXPECT_EQ(count(page, word), 0U) << word;
}

TEST_F(Report, of_a_simulated_scene_shows_all_that_was_promised) {
  capture_small();
  const Outcome outcome = symrig({"report", "scene.h5", "-o", "report.html"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const std::string page = read_text(path("report.html"));
  expect_self_contained(page);
  for (const char* words :
       {"flood-lit", "A vertical bar", "Letters", "Ground truth", "A slice of T", "The level of the leaf",
        "Stopped at each level", "brute force", "frobenius", "indirect", "flood", "relight, natural",
        "simulated capture time", "rank-1", "subdivided"})
    EXPECT_GT(count(page, words), 0U) << words;
  // The scene 3, flood-lit 3, bar 4, bar exposed for indirect light 2, letters 4, slice 3, maps over the
  // picture 2, one for each of the six levels, and four for each of the four held-out photographs that are
  // shown.
  EXPECT_EQ(count(page, "<img"), 3U + 3U + 4U + 2U + 4U + 3U + 2U + 6U + 4U * 4U);
  EXPECT_EQ(count(page, "src=\"data:image/png;base64,\""), 0U);  // no picture is empty
}

TEST_F(Report, every_algorithm_and_colour_have_one) {
  for (const std::string_view algorithm : algorithm_names()) {
    ASSERT_EQ(symrig({"capture", "--rig", std::string(kSmall) + "&channels=3", "-o", "scene.h5",
                      "--algorithm", std::string(algorithm)})
                  .code,
              0);
    const Outcome outcome = symrig({"report", "scene.h5", "-o", "report.html"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    expect_self_contained(read_text(path("report.html")));
  }
}

TEST_F(Report, of_the_smallest_grids_works) {
  for (const char* size : {"1x1", "1x5", "7x1"}) {
    const std::string rig = std::string("sim:plane?noise=off&size=") + size;
    ASSERT_EQ(symrig({"capture", "--rig", rig, "-o", "scene.h5"}).code, 0) << size;
    const Outcome outcome = symrig({"report", "scene.h5", "-o", "report.html"});
    EXPECT_EQ(outcome.code, 0) << size << ": " << outcome.err;
  }
}

TEST_F(Report, bad_input_is_refused) {
  expect_refusal({"report", "none.h5", "-o", "report.html"}, kBadInput, {"none.h5"});
  capture_small();
  expect_refusal({"report", "scene.h5", "-o", "missing/report.html"}, kBadInput, {"missing/report.html"});
  expect_refusal({"report", "scene.h5", "-o", "/proc/report.html"}, kBadInput, {"/proc/report.html"});
}

}  // namespace
}  // namespace symrig::test::report_test
