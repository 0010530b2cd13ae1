// SPDX-License-Identifier: Apache-2.0
// The page of every kind of file is sound, whatever the file says about itself.
#include "page_reader.hpp"
#include "symrig/report/html_report.hpp"

#include <array>

#include <gtest/gtest.h>

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
