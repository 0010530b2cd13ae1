// SPDX-License-Identifier: Apache-2.0
// Rigs whose photographs contradict their patterns. tests/cli/rig_faults_test.py has the table of all faults.
#include "acquisition/light/light_tests.hpp"
#include "dense_scene.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

namespace symrig::tests {
namespace {

constexpr Grid kLit{24, 24};
constexpr double kLitSigma = 1e-3;

/// The photographs of a good rig, spoiled.
Result<CaptureResult> capture_spoiled(const std::function<void(Radiance&)>& spoil,
                                      const CaptureOptions& options = {}) {
  const DenseTransport scene = facing_planes(kLit);
  DenseProbe probe(scene, kLitSigma);
  probe.spoil = spoil;
  return capture(probe, options);
}

void expect_cause(const Result<CaptureResult>& result, const std::string& cause) {
  ASSERT_FALSE(result.ok()) << "not refused: " << cause;
  EXPECT_EQ(result.error().code, ErrorCode::wrong_light) << result.error().line();
  EXPECT_NE(result.error().line().find(cause), std::string::npos) << result.error().line();
}

void darken(Radiance& photograph) {
  Gaussian noise(static_cast<std::uint64_t>(photograph.mean.values()[0] * 1e9F) + 1);
  for (float& v : photograph.mean.values()) v = static_cast<float>(kLitSigma * noise());
}

TEST(LightCheck, darkness_is_refused_by_every_algorithm) {
  for (const AlgorithmInfo& one : algorithms())
    expect_cause(capture_spoiled(darken, {.algorithm = one.algorithm}), "cap on the lens");
}

TEST(LightCheck, unchecked_captures_darkness) {
  const auto result = capture_spoiled(darken, {.unchecked = true});
  ASSERT_TRUE(result.ok()) << result.error().line();
  EXPECT_EQ(result->patterns, 1);
}

TEST(LightCheck, a_good_rig_is_asked_for_no_photograph_more) {
  const DenseTransport scene = facing_planes(kLit);
  DenseProbe probe(scene, kLitSigma);
  const auto result = capture(probe, {});
  ASSERT_TRUE(result.ok()) << result.error().line();
  EXPECT_EQ(probe.cost().photographs, result->patterns);
}

TEST(LightCheck, a_mirrored_picture_is_named_unless_transport_is_symmetric_all_the_same) {
  const auto mirror = [](Radiance& photograph) {
    for (int row = 0; row < kLit.rows; ++row)
      std::ranges::reverse(photograph.mean.plane(0).subspan(
          static_cast<std::size_t>(row) * static_cast<std::size_t>(kLit.cols), kLit.cols));
  };
  expect_cause(capture_spoiled(mirror), "mirrored left to right");
  const DenseTransport wall(kLit, [](int i, int j) { return i == j ? 0.5 : 0.0; });
  DenseProbe probe(wall);
  probe.spoil = mirror;
  EXPECT_TRUE(capture(probe, {}).ok());
}

TEST(LightCheck, one_late_photograph_of_many_is_proven) {
  Image<float> before(kLit);
  int taken = 0;
  expect_cause(capture_spoiled([&](Radiance& photograph) {
                 std::swap(before, photograph.mean);
                 if (++taken != 30) photograph.mean = before;
               }),
               "photograph 30 is the same as the one before");
}

TEST(LightCheck, brute_force_shows_which_photograph_was_late) {
  Image<float> before(kLit);
  int taken = 0;
  const auto result = capture_spoiled(
      [&](Radiance& photograph) {
        std::swap(before, photograph.mean);
        if (++taken != 30) photograph.mean = before;
      },
      {.algorithm = Algorithm::brute});
  ASSERT_TRUE(result.ok()) << result.error().line();
  const auto judged = acquisition::check_columns(result->tensor);
  ASSERT_FALSE(judged.ok());
  EXPECT_NE(judged.error().line().find("photograph 30 of a single pixel"), std::string::npos)
      << judged.error().line();
}

TEST(LightCheck, light_that_goes_one_way_is_no_late_photograph) {
  Gaussian random(3);
  const DenseTransport scene(Grid{7, 7}, [&](int, int) { return std::abs(random()); });
  DenseProbe probe(scene);
  const auto result = capture(probe, {.algorithm = Algorithm::brute});
  ASSERT_TRUE(result.ok()) << result.error().line();
  EXPECT_TRUE(acquisition::check_columns(result->tensor).ok());
}

TEST(LightCheck, planes_that_light_each_other_and_not_themselves_are_no_sharpening) {
  for (const Grid grid : {Grid{9, 14}, Grid{12, 10}}) {
    const DenseTransport scene(grid, [&](int i, int j) {
      const int down = i / grid.cols - j / grid.cols, right = i % grid.cols - j % grid.cols;
      const bool facing = (i % grid.cols < grid.cols / 2) != (j % grid.cols < grid.cols / 2);
      return i == j ? 200.0 : facing ? 400.0 / (20 + down * down + right * right) : 0;
    });
    DenseProbe probe(scene);
    const auto result = capture(probe, {.algorithm = Algorithm::brute});
    ASSERT_TRUE(result.ok()) << result.error().line();
    const auto judged = acquisition::check_columns(result->tensor);
    EXPECT_TRUE(judged.ok()) << judged.error().line();
  }
}

}  // namespace
}  // namespace symrig::tests
