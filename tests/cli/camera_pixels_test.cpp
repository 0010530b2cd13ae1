// SPDX-License-Identifier: Apache-2.0
// T on the camera's own pixels, from a capture to its pictures.
#include "command.hpp"
#include "symrig/image/file.hpp"
#include "symrig/job/capture_job.hpp"
#include "symrig/job/evaluation.hpp"
#include "symrig/report/summary.hpp"
#include "symrig/tensor/file.hpp"
#include "unit/report/page_reader.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace symrig::test::camera_pixels_test {
namespace {

constexpr const char* kFine = "sim:vgroove-textured?size=16x16&fine=4&camera=76x76&turn=1.5&zoom=0.784";
constexpr const char* kFitting = "fitting the camera's pixels";

class CameraPixels : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    ASSERT_EQ(symrig({"calibrate", "--rig", kFine, "-o", "r.h5"}).code, 0);
  }
  Outcome captured(const std::string& output, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"capture", "--rig", kFine, "--registration", "r.h5", "-o", output};
    words.insert(words.end(), more.begin(), more.end());
    return symrig(words);
  }
};

TEST_F(CameraPixels, are_in_the_scene_and_in_its_pictures) {
  const Outcome made = captured("scene.h5", {"--json", "c.json"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_NE(made.out.find("on the camera's own pixels: 76x76"), std::string::npos) << made.out;
  const nlohmann::json camera = json("c.json").at("camera");
  EXPECT_EQ(camera.at("grid"), nlohmann::json::array({76, 76}));
  EXPECT_GT(camera.at("rows").get<int>(), 16 * 16 * 10);
  EXPECT_FALSE(json("c.json").contains("camera_missing"));
  EXPECT_NE(made.out.find("relative errors on the camera's own pixels"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("relative errors on the projector's cells"), std::string::npos) << made.out;
  const Outcome judged = symrig({"evaluate", "scene.h5", "--rig", kFine, "--json", "e.json"});
  ASSERT_EQ(judged.code, 0) << judged.err;
  EXPECT_NE(judged.out.find("relative errors on the camera's own pixels"), std::string::npos) << judged.out;
  // The intervals of the capture hold the truth.
  for (const char* key : {"frobenius", "indirect", "flood", "bar_indirect"}) {
    const double said = camera.at("estimated_error").at(key),
                 is = json("e.json").at("camera").at("error").at(key);
    EXPECT_NEAR(said, is, camera.at("estimated_error_uncertainty").at(key).get<double>()) << key;
  }
  EXPECT_FALSE(std::filesystem::exists(path("scene.h5.log")));
  const Outcome inspected = symrig({"inspect", "scene.h5", "--json", "i.json"});
  EXPECT_NE(inspected.out.find("76x76"), std::string::npos) << inspected.out;
  EXPECT_EQ(json("i.json").at("camera").at("rows"), camera.at("rows"));
  EXPECT_EQ(json("i.json").at("capture").at("camera").at("rows"), camera.at("rows"));

  ASSERT_EQ(symrig({"relight", "scene.h5", "--light", "bar", "-o", "own.pfm"}).code, 0);
  ASSERT_EQ(symrig({"relight", "scene.h5", "--light", "bar", "--cells", "-o", "cells.pfm"}).code, 0);
  EXPECT_EQ(read_image(path("own.pfm"))->grid(), (Grid{76, 76}));
  EXPECT_EQ(read_image(path("cells.pfm"))->grid(), (Grid{16, 16}));
  // Single views are tiles of the cells.
  ASSERT_EQ(symrig({"relight", "scene.h5", "--light", "white", "--views", "1x2", "--to-view", "0,1", "-o",
                    "view.pfm"})
                .code,
            0);
  EXPECT_EQ(read_image(path("view.pfm"))->grid(), (Grid{16, 8}));
}

// Pictures and errors of the page are theirs, and the numbers are those of capture and evaluate.
TEST_F(CameraPixels, are_in_the_report) {
  ASSERT_EQ(captured("scene.h5", {"--json", "c.json"}).code, 0);
  ASSERT_EQ(symrig({"evaluate", "scene.h5", "--rig", kFine, "--json", "e.json"}).code, 0);
  const Outcome made = symrig({"report", "scene.h5", "-o", "report.html"});
  ASSERT_EQ(made.code, 0) << made.err;
  const PageReader page(read_text(path("report.html")));
  std::map<std::string, double> numbers;
  for (const Tag& data : page.named("data")) numbers[data.get("data-from")] = std::stod(data.get("value"));
  const nlohmann::json captured = json("c.json"), evaluated = json("e.json");
  for (const char* key : {"/frobenius", "/indirect", "/flood", "/relight/bar", "/bar_indirect"}) {
    const std::string estimated = std::string("/camera/estimated_error") + key;
    EXPECT_EQ(numbers.at("capture:" + estimated), captured.at(nlohmann::json::json_pointer(estimated)));
    for (const std::string at : {"/camera/error", "/error"}) {
      const double value = evaluated.at(nlohmann::json::json_pointer(at + key));
      EXPECT_NEAR(numbers.at("evaluate:" + at + key), value, 1e-6 * value) << at << key;
    }
  }
  const auto pictures = page.named("img");
  EXPECT_TRUE(std::ranges::any_of(
      pictures, [](const Tag& img) { return img.get("alt") == "chi-square of each pixel"; }));
  // The sides of a PNG are in its bytes 16 to 23: characters 20 to 31 of base 64 begin with byte 15.
  const std::string head = "data:image/png;base64,";
  const auto wide = std::ranges::count_if(pictures, [&](const Tag& img) {
    return img.get("src").substr(head.size() + 20, 12) ==
           "UgAAAEwAAABM";  // R, then 76 twice in four bytes each
  });
  EXPECT_EQ(wide, 3 + 1 + 3 + 3 + 3);  // the top, chi-square, flood-lit, bar and letters, less their lights
}

TEST_F(CameraPixels, are_not_in_an_exported_page) {
  ASSERT_EQ(captured("scene.h5").code, 0);
  const Outcome exported = symrig({"view", "scene.h5", "--export", "scene.html"});
  EXPECT_NE(exported.out.find("scene.html: 16x16 on the projector's cells, "), std::string::npos)
      << exported.out;
  EXPECT_NE(symrig({"view", "scene.h5", "--export", "scene.html", "--cells"}).err.find("--cells"),
            std::string::npos);
}

// Another camera, or another registration of it: the pixels look elsewhere. The cells are the same.
TEST_F(CameraPixels, are_compared_with_their_own_camera_only) {
  ASSERT_EQ(captured("scene.h5").code, 0);
  const Outcome judged =
      symrig({"evaluate", "scene.h5", "--rig",
              "sim:vgroove-textured?size=16x16&fine=4&camera=80x80&zoom=0.784", "--json", "e.json"});
  EXPECT_EQ(judged.code, 0);
  EXPECT_NE(judged.err.find("80x80"), std::string::npos) << judged.err;
  EXPECT_FALSE(json("e.json").contains("camera"));
  const auto scene = load_scene(path("scene.h5"));
  ASSERT_TRUE(scene.ok() && scene->camera);
  const std::string moved = "sim:vgroove-textured?size=16x16&fine=4&camera=76x76&turn=1.4&zoom=0.784";
  ASSERT_EQ(symrig({"calibrate", "--rig", moved, "-o", "r2.h5"}).code, 0);
  for (const auto& [rig, registration, ok] :
       {std::tuple{std::string(kFine), "r.h5", true}, {moved, "r2.h5", false}}) {
    auto opened = open_rig(rig, path(registration), {});
    ASSERT_TRUE(opened.ok());
    const auto errors = judge_camera_by_rig(*scene->camera, *opened->registered, {});
    EXPECT_EQ(errors.ok(), ok);
    if (!ok) {
      EXPECT_NE(errors.error().what.find("registered again"), std::string::npos);
    }
  }
}

TEST_F(CameraPixels, of_many_lights_do_not_mix_with_cells) {
  ASSERT_EQ(captured("scene.h5").code, 0);
  std::filesystem::create_directory(path("lights"));
  ASSERT_TRUE(write_image(path("lights/a.pfm"), Image<float>({16, 16}, 1, 1.F)).ok());
  const std::vector<std::string> own{"relight",  "scene.h5", "--lights", "lights",
                                     "--format", "pfm",      "-o",       "out"};
  ASSERT_EQ(symrig(own).code, 0);
  EXPECT_EQ(read_image(path("out/a.pfm"))->grid(), (Grid{76, 76}));
  std::vector<std::string> cells = own;
  cells.insert(cells.end(), {"--cells", "--resume"});
  expect_refusal(cells, kUsage, {"out"});
}

TEST_F(CameraPixels, are_left_out_when_asked_and_missed_without_a_log) {
  const Outcome asked = captured("a.h5", {"--cells", "--json", "a.json"});
  EXPECT_EQ(asked.code, 0);
  EXPECT_EQ(asked.out.find("camera's"), std::string::npos) << asked.out;
  EXPECT_TRUE(json("a.json").at("camera").is_null());
  const Outcome missed = captured("b.h5", {"--no-log", "--json", "b.json"});
  EXPECT_EQ(missed.code, 0);
  EXPECT_NE(missed.out.find("without a log"), std::string::npos) << missed.out;
  EXPECT_NE(json("b.json").at("camera_missing").get<std::string>().find("log"), std::string::npos);
  const Outcome brute = captured("c.h5", {"--algorithm", "brute"});
  EXPECT_NE(brute.out.find("measures T without symmetry"), std::string::npos) << brute.out << brute.err;
}

// A time that is too short leaves the cells and the log, and the same photographs give the pixels later.
TEST_F(CameraPixels, wait_for_more_seconds) {
  const Outcome late = captured("scene.h5", {"--fit-seconds", "1e-9", "--json", "c.json"});
  ASSERT_EQ(late.code, 0) << late.err;
  EXPECT_NE(late.out.find("the fit needs more than 1e-09 s"), std::string::npos) << late.out;
  EXPECT_TRUE(json("c.json").at("camera").is_null());
  EXPECT_EQ(load_scene(path("scene.h5"))->camera, nullptr);
  ASSERT_TRUE(std::filesystem::exists(path("scene.h5.log")));
  const Outcome more = captured("scene.h5", {"--fit-seconds", "600", "--resume", "--json", "d.json"});
  ASSERT_EQ(more.code, 0) << more.err;
  EXPECT_FALSE(json("d.json").at("camera").is_null());
  EXPECT_EQ(json("d.json").at("replayed"), json("d.json").at("patterns"));
  EXPECT_FALSE(std::filesystem::exists(path("scene.h5.log")));
  const Outcome none = captured("other.h5", {"--fit-seconds", "0"});
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.err.find("allows no fit"), std::string::npos) << none.err;
  expect_refusal({"capture", "--rig", "sim:plane?size=8x8", "-o", "p.h5", "--fit-seconds", "5"}, kUsage,
                 {"--fit-seconds has no effect"});
}

Result<CaptureOutcome> run(const std::string& registration, const std::string& output, bool resume,
                           bool stop_at_fit) {
  SYMRIG_TRY(OpenedRig rig, open_rig(kFine, registration, {}));
  CaptureJob job;
  job.output = output;
  job.log.resume = resume;
  job.options.progress = [=](const ProgressEvent& event) { return !stop_at_fit || event.stage != kFitting; };
  return run_job(job, rig);
}

// The scene on the cells is complete before the fit, and photographs are not taken again.
TEST_F(CameraPixels, a_stopped_fit_leaves_the_scene_and_goes_on) {
  const std::string registration = path("r.h5"), output = path("scene.h5");
  const auto stopped = run(registration, output, false, true);
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::interrupted);
  EXPECT_NE(stopped.error().what.find("without the camera's own pixels"), std::string::npos);
  EXPECT_EQ(stopped.error().what.find("after 0 photographs"), std::string::npos) << stopped.error().what;
  EXPECT_NE(stopped.error().hint.find("resume"), std::string::npos) << stopped.error().hint;
  const auto cells = load_scene(output);
  ASSERT_TRUE(cells.ok());
  EXPECT_EQ(cells->camera, nullptr);
  // Who opens it later is told, also of a process that was killed and could tell nothing.
  EXPECT_NE(symrig({"inspect", "scene.h5"}).out.find("own pixels: their fit was broken off; resume"),
            std::string::npos);
  ASSERT_EQ(symrig({"report", "scene.h5", "-o", "report.html"}).code, 0);
  EXPECT_NE(read_text(path("report.html")).find("their fit was broken off"), std::string::npos);
  ASSERT_TRUE(std::filesystem::exists(output + ".log"));
  const auto resumed = run(registration, output, true, false);
  ASSERT_TRUE(resumed.ok()) << resumed.error().line();
  EXPECT_EQ(resumed->summary.replayed, resumed->result.patterns);
  EXPECT_EQ(missing_pixels(*load_scene(output)), "");
  const auto whole = run(registration, path("whole.h5"), false, false);
  ASSERT_TRUE(whole.ok());
  const auto a = load_scene(output), b = load_scene(path("whole.h5"));
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_TRUE(a->camera && b->camera);
  EXPECT_EQ(a->camera->parts().codes, b->camera->parts().codes);
  EXPECT_EQ(a->camera->parts().brightness, b->camera->parts().brightness);
  EXPECT_FALSE(std::filesystem::exists(output + ".log"));
}

}  // namespace
}  // namespace symrig::test::camera_pixels_test
