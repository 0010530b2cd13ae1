// SPDX-License-Identifier: Apache-2.0
// A scene that is being captured: what its server answers, and that capturing and serving do not disturb each
// other.
#include "symrig/viewer/live.hpp"

#include "assert_ok.hpp"
#include "symrig/job/capture_page.hpp"
#include "viewer/view_service.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace symrig::live_test {
namespace {

constexpr Grid kGrid{4, 4};

/// T = value · identity.
TransportTensor scaled(float value) {
  TensorBuilder builder(BlockTree(kGrid), 1);
  for (std::int32_t i = 0; i < 16; ++i) builder.add_scalar(i, i, std::vector<float>{value});
  return std::move(builder).finish();
}

/// All pixels lit: one run.
std::string white() {
  std::string bytes;
  for (const std::uint32_t word : {1U, 1U, 0U, 16U})
    bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
  constexpr std::uint16_t kOne = 0x3C00;
  for (int k = 0; k < 16; ++k) bytes.append(reinterpret_cast<const char*>(&kOne), sizeof kOne);
  return bytes;
}

class Live : public ::testing::Test {
 protected:
  viewer::ViewReply get(const std::string& what) {
    const std::string target = "/s/" + what;
    return service.answer({.method = "GET", .target = target, .host = "localhost"});
  }
  viewer::ViewReply relight() {
    const std::string light = white();
    return service.answer({.method = "POST", .target = "/s/relight", .host = "localhost", .body = light});
  }
  /// The value of the first pixel of a picture.
  static float first_value(const viewer::ViewReply& reply) {
    std::int32_t exponent = 0;
    std::uint16_t half = 0;
    std::memcpy(&exponent, reply.body.data(), 4);
    std::memcpy(&half, reply.body.data() + 4, 2);
    return std::ldexp(1 + static_cast<float>(half & 1023U) / 1024, (half >> 10) - 15 + exponent);
  }

  std::shared_ptr<LiveScene> scene = std::make_shared<LiveScene>(kGrid, 1, ViewLayout{});
  viewer::LiveService service{scene, {.title = "t", .truth = {}}, "s", "n"};
};

TEST_F(Live, has_no_picture_before_the_first_tensor) {
  EXPECT_EQ(get("").status, 200U);
  EXPECT_NE(get("").body.find("\"live\":true"), std::string::npos);
  for (const char* what : {"facts", "leaves", "last"}) EXPECT_EQ(get(what).status, 404U) << what;
  EXPECT_EQ(relight().status, 404U);
  const auto status = nlohmann::json::parse(get("live").body);
  EXPECT_EQ(status.at("tensor"), 0);
  EXPECT_EQ(status.at("complete"), false);
  EXPECT_TRUE(status.at("toGo").is_null());
}

TEST_F(Live, shows_what_was_handed_over_last) {
  scene->show(std::nullopt, [] { return scaled(0.25F); });
  scene->show(LiveLevel{.level = 0, .photographs = 7, .error = 0.5, .half_width = 0.1},
              [] { return scaled(0.5F); });
  scene->show(LiveStatus{.stage = "level 1", .done = 9, .expected = 20, .frames = 30, .to_go = 5});
  scene->show(LivePhotograph{Pattern(kGrid), Image<float>(kGrid)});
  const auto status = nlohmann::json::parse(get("live").body);
  EXPECT_EQ(status.at("tensor"), 2);
  EXPECT_EQ(status.at("photograph"), 1);
  EXPECT_EQ(status.at("stage"), "level 1");
  EXPECT_EQ(status.at("frames"), 30);
  EXPECT_EQ(status.at("levels").size(), 1U);
  EXPECT_EQ(status.at("levels")[0].at("error"), 0.5);
  EXPECT_EQ(get("last").body.size(), 2 * (4 + 32U));
  EXPECT_FLOAT_EQ(first_value(relight()), 0.5F);
  EXPECT_EQ(nlohmann::json::parse(get("facts").body).at("live"), true);
}

/// The serving thread makes a tensor only if somebody asks, and once.
TEST_F(Live, makes_tensors_when_asked) {
  int made = 0;
  for (int k = 0; k < 3; ++k)
    scene->show(std::nullopt, [&made] {
      ++made;
      return scaled(1);
    });
  get("live");
  EXPECT_EQ(made, 0);
  relight();
  relight();
  EXPECT_EQ(made, 1);
}

TEST_F(Live, becomes_the_page_of_the_scene) {
  scene->show(std::nullopt, [] { return scaled(0.25F); });
  EXPECT_FLOAT_EQ(first_value(relight()), 0.25F);
  StoredScene whole;
  whole.tensor = scaled(0.5F);
  scene->complete(std::move(whole), {});
  EXPECT_EQ(nlohmann::json::parse(get("live").body).at("complete"), true);
  const auto facts = nlohmann::json::parse(get("facts").body);
  EXPECT_FALSE(facts.contains("live"));
  EXPECT_EQ(facts.at("packed"), true);
  EXPECT_FLOAT_EQ(first_value(relight()), 0.5F);
  EXPECT_EQ(get("pack").status, 200U);
}

TEST_F(Live, says_why_the_capture_failed) {
  EXPECT_FALSE(scene->watched_within(Nanoseconds{60'000'000'000}));
  EXPECT_TRUE(nlohmann::json::parse(get("live").body).at("failed").is_null());
  EXPECT_TRUE(scene->watched_within(Nanoseconds{600'000'000'000}));
  EXPECT_FALSE(scene->failure_told());
  scene->show(std::nullopt, [] { return scaled(0.25F); });
  scene->show(LiveStatus{.stage = "level 1", .done = 9});
  scene->fail("the lamp is cold; \"wait\"");
  EXPECT_FALSE(scene->failure_told());
  const auto status = nlohmann::json::parse(get("live").body);
  EXPECT_EQ(status.at("failed"), "the lamp is cold; \"wait\"");
  EXPECT_EQ(status.at("complete"), false);
  EXPECT_EQ(status.at("done"), 9);
  EXPECT_TRUE(scene->failure_told());
  EXPECT_FLOAT_EQ(first_value(relight()), 0.25F);  // the last picture stays
}

TEST_F(Live, refuses_requests_from_elsewhere) {
  const auto status = [&](std::string_view method, std::string_view target, std::string_view host,
                          std::string_view origin = "") {
    const viewer::ViewRequest request{.method = method, .target = target, .host = host, .origin = origin};
    return service.answer(request).status;
  };
  EXPECT_EQ(status("GET", "/s/live", "127.0.0.1:8080"), 200U);
  EXPECT_EQ(status("GET", "/s/live", "evil.example"), 403U);
  EXPECT_EQ(status("GET", "/s/live", "localhost", "http://evil.example"), 403U);
  EXPECT_EQ(status("GET", "/x/live", "localhost"), 403U);
  EXPECT_EQ(status("PUT", "/s/live", "localhost"), 405U);
  EXPECT_EQ(status("GET", "/s/relight", "localhost"), 405U);
  EXPECT_EQ(status("POST", "/s/live", "localhost"), 404U);
  EXPECT_EQ(status("GET", "/s/pack", "localhost"), 404U);
}

/// One thread hands over, the other one answers: a sanitizer for threads watches this.
TEST_F(Live, hands_over_between_threads) {
  std::atomic<bool> done = false;
  std::thread capturing([&] {
    for (int k = 0; k < 2000; ++k) {
      scene->show(LiveStatus{.stage = "level " + std::to_string(k), .done = k});
      scene->show(LivePhotograph{Pattern(kGrid), Image<float>(kGrid)});
      if (k % 100 == 0) scene->show(LiveLevel{k / 100, k, 0.5, 0.1}, [] { return scaled(1); });
    }
    StoredScene whole;
    whole.tensor = scaled(2);
    scene->complete(std::move(whole), {});
    done = true;
  });
  while (!done) {
    EXPECT_EQ(get("live").status, 200U);
    get("last");
    relight();
  }
  capturing.join();
  EXPECT_FLOAT_EQ(first_value(relight()), 2);
}

constexpr const char* kRig = "sim:vgroove-textured?size=16x20";

/// A capture into memory, with or without a page that shows it.
Result<CaptureOutcome> captured(std::string_view algorithm, bool with_page) {
  SYMRIG_TRY(OpenedRig rig, open_rig(kRig, "", {}));
  CaptureJob job;
  SYMRIG_TRY(job.options.algorithm, parse_algorithm(algorithm));
  if (!with_page) return run_job(job, rig);
  SYMRIG_TRY(const CapturePage page, CapturePage::open(rig, {.title = "t", .truth = {}}));
  SYMRIG_TRY(CaptureOutcome outcome, run_job(page.watched(job, rig), rig));
  page.complete(outcome);
  return outcome;
}

/// The photograph of each single pixel, one after the other.
std::vector<float> columns(const TransportTensor& tensor) {
  std::vector<float> all;
  for (std::size_t k = 0; k < static_cast<std::size_t>(tensor.projector_grid().size()); ++k) {
    Image<float> pixel(tensor.projector_grid());
    pixel.values()[k] = 1;
    const auto seen = tensor.apply(pixel);
    if (seen) all.insert(all.end(), seen->values().begin(), seen->values().end());
  }
  return all;
}

/// A watched capture takes the same photographs and finds the same tensor, bit for bit.
TEST(CapturePage, changes_nothing) {
  for (const std::string_view algorithm : algorithm_names()) {
    const auto alone = captured(algorithm, false), watched = captured(algorithm, true);
    ASSERT_OK(alone);
    ASSERT_OK(watched);
    EXPECT_EQ(alone->result.patterns_per_level, watched->result.patterns_per_level);
    EXPECT_EQ(alone->result.error_per_level, watched->result.error_per_level);
    const std::vector<float> a = columns(alone->result.tensor), b = columns(watched->result.tensor);
    ASSERT_EQ(a.size(), 320U * 320U);
    ASSERT_EQ(b.size(), a.size());
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0) << algorithm;
  }
}

double relative_difference(std::span<const float> a, std::span<const float> of) {
  double apart = 0, size = 0;
  for (std::size_t k = 0; k < of.size(); ++k) {
    apart += std::pow(static_cast<double>(a[k]) - static_cast<double>(of[k]), 2);
    size += std::pow(static_cast<double>(of[k]), 2);
  }
  return std::sqrt(apart / size);
}

/// Under white light, each tensor so far shows the flood-lit photograph. Under one pixel they come near the
/// truth, as the search estimates.
TEST(CaptureSnapshot, is_the_scene_so_far) {
  const std::string name = "sim:vgroove-textured?size=32x32&noise=off&black=0";
  auto rig = open_rig(name, "", {});
  ASSERT_OK(rig);
  const auto truth = open_truth(name);
  ASSERT_OK(truth);
  CaptureJob job;
  std::vector<CaptureSnapshot> all;
  job.options.watch = [&](const CaptureSnapshot& found) { all.push_back(found); };
  const auto outcome = run_job(job, *rig);
  ASSERT_OK(outcome);
  ASSERT_EQ(all.size(), outcome->result.steps.size() + 1);
  ASSERT_GE(all.size(), 4U);
  Image<float> white((*truth)->grid());
  std::fill(white.values().begin(), white.values().end(), 1.0F);
  const Image<float> flood = (*truth)->apply(white);
  std::vector<float> exact;
  for (std::size_t k = 0; k < white.values().size(); ++k) {
    Image<float> pixel(white.grid());
    pixel.values()[k] = 1;
    const Image<float> seen = (*truth)->apply(pixel);
    exact.insert(exact.end(), seen.values().begin(), seen.values().end());
  }
  for (std::size_t k = 0; k < all.size(); ++k) {  // their tensors are made after the capture
    const TransportTensor tensor = all[k].tensor();
    const auto seen = tensor.apply(white);
    ASSERT_OK(seen);
    // Blocks share light in proportion, so a flood-lit picture is right up to the misfit of leaves.
    EXPECT_LT(relative_difference(seen->values(), flood.values()), 0.05) << k;
    ASSERT_EQ(all[k].step.has_value(), k > 0);
    if (k == 0) continue;
    ASSERT_TRUE(all[k].step->error && all[k].half_width);
    const double error = relative_difference(columns(tensor), exact);
    EXPECT_NEAR(error, *all[k].step->error, 3 * *all[k].half_width) << k;
  }
}

}  // namespace
}  // namespace symrig::live_test
