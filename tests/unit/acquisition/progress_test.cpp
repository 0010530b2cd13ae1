// SPDX-License-Identifier: Apache-2.0
// Progress and stops, from the first photograph to the complete tensor.
#include "dense_scene.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace symrig::progress_test {
namespace {

struct Told {
  std::string stage;
  std::int64_t photographs;
  StepCount steps;
  bool computing;
  double cpu_seconds;  ///< of this process by then: a busy machine does not lengthen them
};

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

CaptureOptions refitted() {
  CaptureOptions options;
  options.polish = 2;
  return options;
}

/// One thread: its events are the same each time.
Result<CaptureResult> told_by(const tests::DenseTransport& scene, std::vector<Told>& told) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  tests::DenseProbe rig(scene);
  CaptureOptions options = refitted();
  const auto tell = [&](std::string_view stage, const ProgressEvent& event) {
    told.push_back({std::string(stage), event.done, event.steps, event.computing, cpu_seconds()});
  };
  options.progress = [&](const ProgressEvent& event) {
    tell(event.stage, event);
    return true;
  };
  tell("begin", {});
  auto result = capture(rig, options);
  tell("end", {});
  return result;
}

bool has_stage(const std::vector<Told>& told, const char* stage) {
  return std::any_of(told.begin(), told.end(), [stage](const Told& one) { return one.stage == stage; });
}

TEST(ProgressOfACapture, moves_in_every_stage_until_the_end) {
  std::vector<Told> told;
  const auto result = told_by(tests::facing_planes({32, 40}), told);
  ASSERT_TRUE(result.ok()) << result.error().line();
  for (const char* stage :
       {"flood-lit", "checks", "level 0", "level 3", "direct light", "refit of the direct light", "refit",
        "merging leaves", "packing the tensor", "estimated errors"})
    EXPECT_TRUE(has_stage(told, stage)) << stage;
  // A share, because a sanitizer makes all of it slower.
  const double all = told.back().cpu_seconds - told.front().cpu_seconds;
  for (std::size_t k = 1; k < told.size(); ++k) {
    const Told &before = told[k - 1], &now = told[k];
    EXPECT_LT(now.cpu_seconds - before.cpu_seconds, 0.05 + 0.1 * all)
        << before.stage << ", then " << now.stage;
    if (now.stage != before.stage) continue;
    EXPECT_GE(now.photographs, before.photographs);
    EXPECT_LE(now.photographs - before.photographs, 1);
    EXPECT_LE(now.steps.done - before.steps.done, 2) << now.stage;
  }
}

TEST(ProgressOfACapture, knows_how_long_the_refit_takes) {
  std::vector<Told> told;
  ASSERT_TRUE(told_by(tests::facing_planes({32, 40}), told).ok());
  const auto last =
      std::find_if(told.rbegin(), told.rend(), [](const Told& one) { return one.stage == "refit"; });
  ASSERT_NE(last, told.rend());
  EXPECT_GT(last->steps.done, 20);
  EXPECT_LE(last->steps.done, last->steps.expected);
  EXPECT_GT(static_cast<double>(last->steps.done), 0.8 * static_cast<double>(last->steps.expected));
}

void expect_same(const TransportTensor& a, const TransportTensor& b) {
  EXPECT_TRUE(std::ranges::equal(*a.factors(), *b.factors()));
  EXPECT_TRUE(std::ranges::equal(a.scalar_values(), b.scalar_values()));
}

TEST(ProgressOfACapture, changes_no_bit) {
  const tests::DenseTransport scene = tests::facing_planes({16, 21});
  std::vector<Told> told;
  const auto watched = told_by(scene, told);
  tests::DenseProbe rig(scene);
  const auto alone = capture(rig, refitted());
  ASSERT_TRUE(watched.ok() && alone.ok());
  expect_same(watched->tensor, alone->tensor);
  EXPECT_EQ(watched->estimated->frobenius, alone->estimated->frobenius);
}

/// Captures until progress is told for the n-th time; n = 0: to the end. Returns how often it was told.
int run(const tests::DenseTransport& scene, PhotographLog& log, int n, Result<CaptureResult>& result) {
  tests::DenseProbe rig(scene);
  LoggedProbe logged(rig, log);
  CaptureOptions options = refitted();
  int calls = 0;
  options.log = &log;
  options.progress = [&](const ProgressEvent&) { return ++calls != n; };
  result = capture(logged, options);
  return calls;
}

TEST(ProgressOfACapture, stopped_at_any_moment_and_continued_is_the_same) {
  constexpr int kMoments = 20;
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const tests::DenseTransport scene = tests::facing_planes({16, 21});
  const auto new_log = [&] { return make_memory_log(scene.grid(), 1); };
  Result<CaptureResult> reference = Error{ErrorCode::interrupted, ""};
  const int calls = run(scene, *new_log(), 0, reference);
  ASSERT_TRUE(reference.ok()) << reference.error().line();
  ASSERT_GT(calls, kMoments);
  for (int moment = 1; moment <= kMoments; ++moment) {
    const auto log = new_log();
    Result<CaptureResult> result = Error{ErrorCode::limit, ""};
    const int at = moment * calls / kMoments;
    EXPECT_EQ(run(scene, *log, at, result), at) << "nothing is told after the stop";
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::interrupted);
    EXPECT_TRUE(result.error().what.starts_with("capture stopped after ")) << result.error().what;
    run(scene, *log, 0, result);
    ASSERT_TRUE(result.ok()) << result.error().line();
    expect_same(result->tensor, reference->tensor);
  }
}

}  // namespace
}  // namespace symrig::progress_test
