// SPDX-License-Identifier: Apache-2.0

#include "report/html.hpp"

#include "page_reader.hpp"
#include "symrig/report/html_report.hpp"

#include <array>
#include <limits>

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

namespace symrig::report::save_link_test {

namespace {

TEST(SaveLink, names_of_files_are_plain) {
  EXPECT_EQ(file_stem("a scene"), "a-scene");
  EXPECT_EQ(file_stem("../../etc/passwd"), "etc-passwd");
  EXPECT_EQ(file_stem("\"><script>"), "script");
  EXPECT_EQ(file_stem("///"), "symrig");
  EXPECT_EQ(file_stem(""), "symrig");
  EXPECT_LE(file_stem(std::string(1000, 'x')).size(), 100U);
}

TEST(SaveLink, csv_quotes_and_disarms) {
  Csv csv({"name", "value"});
  csv.add({"a,b", "1.5"});
  csv.add({"=1+2", "-0.5"});
  csv.add({"say \"x\"", "1e-07"});
  EXPECT_EQ(csv.text(), "name,value\r\n\"a,b\",1.5\r\n'=1+2,-0.5\r\n\"say \"\"x\"\"\",1e-07\r\n");
}

TEST(SaveLink, exact_numbers_read_back) {
  EXPECT_EQ(std::stod(exact(0.1 + 0.2)), 0.1 + 0.2);
  EXPECT_EQ(exact(std::numeric_limits<double>::infinity()), "");
}

TEST(SaveLink, only_finite_pictures_of_some_size_become_openexr) {
  Image<float> image({2, 2}, 1, 1.0F);
  EXPECT_NE(exr_link("f", "a picture", image), "");
  image.at(0, 0) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(exr_link("f", "a picture", image), "");
  EXPECT_EQ(exr_link("f", "a picture", Image<float>({600, 600})), "");
}

}  // namespace

}  // namespace symrig::report::save_link_test

namespace symrig::report_page_test {

namespace {

using test::expect_sound, test::PageReader, test::Tag;

/// Direct light, a pair of blocks, an empty pair and a band.
StoredScene symmetric(Grid grid, int channels) {
  TensorBuilder builder(BlockTree(grid), channels);
  const std::vector<float> one(channels, 1.0F);
  for (std::int32_t i = 0; i < grid.size(); ++i) builder.add_scalar(i, i, one);
  const BlockTree tree(grid);
  if (tree.levels() > 1 && tree.level(1).size() > 1) {
    const Block& a = tree.level(1)[0];
    const Block& b = tree.level(1)[1];
    const std::vector<float> factors(
        static_cast<std::size_t>(channels) * static_cast<std::size_t>(a.size() + b.size()), 0.01F);
    builder.add_leaf(b.begin, b.end, a.begin, a.end, 1, 1, factors);
    if (tree.level(1).size() > 2) builder.add_empty(1, 2, 0);
  }
  return {std::move(builder).finish(), "{}", {}};
}

/// Measured columns between two grids, as dual photography and brute force leave them.
StoredScene general(Grid camera, Grid projector) {
  TensorBuilder builder{BlockTree(camera), BlockTree(projector), 1};
  const std::array<std::int32_t, 1> row{0};
  const std::array<float, 1> value{0.5F};
  for (std::int32_t j = 0; j < projector.size(); ++j) builder.add_column(j, j + 1, row, value);
  return {std::move(builder).finish(), "{}", {}};
}

constexpr const char* kTold =
    R"({"scene": "sim:plane?size=4x6", "algorithm": "symrig", "patterns": 60, "patterns_brute_force": 1024, "rig_seconds": 90,
        "patterns_per_level": [7, 4, 16, 30, 3], "error_per_level": [0.5, 0.25, 0.01], "estimated_error": {"frobenius": 0.005},
        "error_per_level_uncertainty": [0.1, 0.05, 0.02], "seconds": {"total": 2}, "command_line": "symrig capture", "version": "0.1.0",
        "steps": [{"level": 0, "patterns": 11, "rig_seconds": 16, "error": 0.5}, {"level": 1, "patterns": 27, "rig_seconds": 40, "error": 0.25},
                  {"level": 2, "patterns": 57, "rig_seconds": 85, "error": 0.01}]})";

// Numbers that no capture has, of kinds that no key has.
constexpr std::array kHostile{
    R"({"patterns": 1e308, "patterns_brute_force": 0, "rig_seconds": -1, "frames": 1e300})",
    R"({"patterns": 0, "patterns_brute_force": 1e14, "seconds": {"total": 1e307, "process": -5, "merge": null}})",
    R"({"patterns_per_level": [1e308, -1, "x", null, 3], "error_per_level": [0, 1e308, -2, null]})",
    R"({"patterns_per_level": [7, 4], "error_per_level": [1, 2, 3, 4, 5], "patterns": 5, "rig_seconds": 1e-300})",
    R"({"steps": [{"level": 1e9, "patterns": 1}, {"level": -1}, 7, {"level": 0, "patterns": 0, "rig_seconds": 0, "error": 1e-320}], "patterns": 1})",
    R"({"steps": {"levels": []}, "estimated_error": [1], "stopped_by": ["<b>"], "scene": 7, "command_line": "<script>'\"&"})",
    R"({"estimated_error": {"frobenius": 1e14, "relight": {"bar": -0.5}}, "estimated_error_uncertainty": {"frobenius": 1e13}})"};

TEST(ReportPage, is_sound_for_every_kind_of_tensor) {
  std::vector<StoredScene> scenes;
  for (const Grid grid : {Grid{1, 1}, Grid{3, 5}, Grid{1, 7}, Grid{16, 12}}) {
    scenes.push_back(symmetric(grid, 1));
    scenes.push_back(symmetric(grid, 3));
  }
  scenes.push_back(general({4, 6}, {4, 6}));
  scenes.push_back(general({5, 9}, {3, 2}));
  for (StoredScene& scene : scenes) {
    const std::string grid = to_string(scene.tensor.camera_grid());
    for (const bool held_out : {false, true})
      for (const char* json : {"{}", kTold}) {
        scene.capture_json = json;
        scene.held_out.clear();
        if (held_out)
          scene.held_out.push_back({"bar", Image<float>(scene.tensor.projector_grid(), 1, 1.0F),
                                    Image<float>(scene.tensor.camera_grid(), scene.tensor.channels(), 1.0F)});
        const auto page = html_report(scene, {.title = "a scene.h5"});
        ASSERT_TRUE(page.ok()) << grid;
        expect_sound(PageReader(*page));
      }
  }
}

TEST(ReportPage, is_sound_whatever_the_file_says) {
  StoredScene scene = symmetric({6, 6}, 1);
  for (const char* json : kHostile) {
    scene.capture_json = json;
    const auto page = html_report(scene, {.title = "<x>"});
    ASSERT_TRUE(page.ok()) << json;
    expect_sound(PageReader(*page));
    EXPECT_LT(page->size(), 2'000'000U) << json;  // no count of the file makes the page longer
  }
}

TEST(ReportPage, opens_with_the_scene) {
  StoredScene scene = symmetric({8, 8}, 1);
  scene.capture_json = kTold;
  scene.held_out.push_back({"random half", Image<float>({8, 8}, 1, 1.0F), Image<float>({8, 8}, 1, 1.0F)});
  const PageReader page(*html_report(scene, {.title = "t"}));
  const std::vector<Tag> pictures = page.named("img");
  ASSERT_GE(pictures.size(), 3U);
  EXPECT_EQ(pictures[0].get("alt"), "flood-lit");
  EXPECT_EQ(pictures[1].get("alt"), "relit by a vertical bar");
  EXPECT_EQ(pictures.back().get("alt"), "difference");  // dots that were held out come last
}

TEST(ReportPage, plots_the_error_over_patterns_and_over_seconds) {
  StoredScene scene = symmetric({8, 8}, 1);
  scene.capture_json = kTold;
  int charts = 0;
  for (const Tag& svg : PageReader(*html_report(scene, {.title = "t"})).named("svg"))
    if (svg.get("aria-label").find("relative error of T over") != std::string::npos) ++charts;
  EXPECT_EQ(charts, 2);
  const std::string page = *html_report(scene, {.title = "t"});
  EXPECT_NE(page.find("<title>level 2: 1.0\xC2\xA0% ± 2.0\xC2\xA0%</title>"), std::string::npos);
  scene.capture_json = "{}";
  EXPECT_NE(html_report(scene, {.title = "t"})->find("no curve of the error over patterns or seconds"),
            std::string::npos);
}

// Pictures of 72 x 72 pixels and numbers can be saved: each link has a name and bytes.
TEST(ReportPage, saves_pictures_and_numbers) {
  StoredScene scene = symmetric({72, 72}, 3);
  scene.capture_json = kTold;
  std::map<std::string, std::string> saved;
  for (const Tag& link : PageReader(*html_report(scene, {.title = "dir/a scene.h5"})).named("a"))
    EXPECT_TRUE(link.get("download").empty() || saved.emplace(link.get("download"), link.get("href")).second)
        << link.get("download");
  EXPECT_TRUE(saved["a-scene-flood-lit.png"].starts_with("data:image/png;base64,iVBOR"));
  EXPECT_TRUE(saved["a-scene-flood-lit.exr"].starts_with("data:image/x-exr;base64,di8xA"));  // 76 2f 31 01
  EXPECT_TRUE(
      saved["a-scene-stages.csv"].starts_with("data:text/csv;charset=utf-8;base64,c3RhZ2U"));  // "stage"
  EXPECT_TRUE(saved.contains("a-scene-mean-level.exr"));
  EXPECT_TRUE(saved.contains("a-scene-slice.png"));
}

TEST(ReportPage, tells_when_and_how_it_was_made) {
  StoredScene scene = symmetric({4, 4}, 1);
  scene.capture_json = kTold;
  const auto page =
      html_report(scene, {.title = "t", .made = {"2026-01-31T23:59:58Z", "0.1.0", "symrig report <x>"}});
  for (const char* words : {"2026-01-31T23:59:58Z", "symrig capture", "symrig report &lt;x&gt;"})
    EXPECT_NE(page->find(words), std::string::npos) << words;
}

}  // namespace

}  // namespace symrig::report_page_test
