// SPDX-License-Identifier: Apache-2.0
#include "dense_scene.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

namespace symrig::budget_test {
namespace {

using tests::default_options;
using tests::DenseProbe;
using tests::DenseTransport;
using tests::facing_planes;

/// A rig whose clock runs `seconds` a photograph.
class ClockProbe : public DenseProbe {
 public:
  ClockProbe(const DenseTransport& scene, double seconds) : DenseProbe(scene), seconds_(seconds) {}
  ProbeCost cost() const override {
    ProbeCost spent = DenseProbe::cost();
    spent.rig_seconds = seconds_ * static_cast<double>(spent.photographs);
    return spent;
  }

 private:
  double seconds_;
};

class Budget : public testing::Test {
 protected:
  struct Outcome {
    std::int64_t patterns;
    TransportErrors errors;
    std::string stopped_by;
  };
  Outcome capture_within(std::int64_t most, double sigma = 0) const {
    DenseProbe probe(scene, sigma);
    CaptureOptions options = default_options();
    options.max_patterns = most;
    const auto result = capture(probe, options);
    EXPECT_TRUE(result.ok()) << most;
    EXPECT_EQ(result->patterns, probe.cost().photographs) << most;
    return {result->patterns, *evaluate(result->tensor, scene.truth()), result->stopped_by};
  }

  DenseTransport scene = facing_planes(Grid{16, 16});
};

constexpr std::int64_t kBudgets[] = {1, 2, 7, 8, 20, 50, 100};

TEST_F(Budget, the_most_photographs_are_never_exceeded) {
  const std::int64_t all = capture_within(0).patterns;
  for (const double sigma : {0.0, 1e-3})
    for (const std::int64_t most : kBudgets) {
      const Outcome outcome = capture_within(most, sigma);
      EXPECT_LE(outcome.patterns, most) << sigma;
      if (most < all) {
        EXPECT_EQ(outcome.stopped_by, "max_patterns") << most << ' ' << sigma;
      }
    }
}

TEST_F(Budget, the_tensor_is_complete_whatever_the_budget) {
  // Every block is stored as what its images say, so the flood-lit photograph is met: noise-free to what
  // leaves below the tolerance of 3e-4 F miss and to rounding; and no error is that of an empty tensor, 1.
  for (const std::int64_t most : kBudgets) {
    const TransportErrors errors = capture_within(most).errors;
    EXPECT_LE(errors.flood, 0.01) << most;
    EXPECT_LT(errors.frobenius, 1) << most;
    EXPECT_TRUE(std::isfinite(errors.indirect)) << most;
  }
}

TEST_F(Budget, the_error_falls_with_the_budget_on_the_whole) {
  std::vector<double> errors;
  for (const std::int64_t most : kBudgets) errors.push_back(capture_within(most).errors.frobenius);
  int rises = 0;
  for (std::size_t k = 1; k < errors.size(); ++k) rises += errors[k] > errors[k - 1] * 1.01 ? 1 : 0;
  EXPECT_LE(rises, 2) << testing::PrintToString(errors);
  EXPECT_LT(errors.back(), errors.front() / 2);
}

TEST_F(Budget, a_budget_that_is_large_enough_changes_nothing) {
  const Outcome free = capture_within(0);
  const Outcome bound = capture_within(free.patterns);
  EXPECT_EQ(bound.patterns, free.patterns);
  EXPECT_EQ(free.stopped_by, "done");
  EXPECT_EQ(bound.errors.frobenius, free.errors.frobenius);
}

TEST_F(Budget, time_on_the_clock_of_the_rig_is_never_exceeded) {
  for (const double each : {0.25, 3.0})
    for (const int photographs : {7, 12, 30}) {
      ClockProbe probe(scene, each);
      CaptureOptions options = default_options();
      options.max_seconds = each * photographs;
      const auto result = capture(probe, options);
      ASSERT_TRUE(result.ok());
      EXPECT_LE(probe.cost().rig_seconds, options.max_seconds) << each << ' ' << photographs;
      EXPECT_GT(probe.cost().photographs, photographs / 2) << "the budget is used";
      EXPECT_EQ(result->stopped_by, "max_seconds");
      EXPECT_LE(evaluate(result->tensor, scene.truth())->flood, 0.01);
    }
}

/// A planned photograph of a dim scene takes seconds, and black light fills its frames. The opening of the
/// rig counts, and so do the photographs of the dark projector.
TEST(BudgetOfSeconds, is_kept_by_a_rig_that_plans_its_exposures) {
  for (const std::string scene : {"gummy", "mirror", "random"})
    for (const char* light : {"", "light=0.1", "light=0.01", "black=0.02", "black=0.1"})
      for (const double most : {1.0, 3.0, 10.0}) {
        const std::string uri = "sim:" + scene + "?size=32x32&" + light;
        SCOPED_TRACE(uri + " in " + std::to_string(most));
        VirtualRigHooks hooks;
        hooks.options = [most](RigOptions& rig_options) { rig_options.most_seconds = most; };
        const auto rig = open_virtual_rig(uri, hooks);
        ASSERT_TRUE(rig.ok());
        CaptureOptions options;
        options.max_seconds = most;
        const auto result = capture(**rig, options);
        ASSERT_TRUE(result.ok()) << result.error().line();
        EXPECT_LE((*rig)->cost().rig_seconds, most);
        EXPECT_TRUE(result->stopped_by != "max_seconds" || (*rig)->cost().rig_seconds > 0.75 * most)
            << (*rig)->cost().rig_seconds;
        ASSERT_TRUE(result->estimated);
        if (std::isnan(result->estimated->frobenius)) {
          EXPECT_FALSE(result->estimate_not_given.empty());
          continue;
        }
        // The interval holds in 95 %; three times as wide it always does.
        const TransportErrors errors = *evaluate(
            result->tensor,
            [&](const Image<float>& p) -> Result<Image<float>> { return (*rig)->truth().apply(p); });
        EXPECT_NEAR(result->estimated->frobenius, errors.frobenius,
                    3 * result->estimated_half_width.frobenius);
      }
}

TEST(BudgetOfSeconds, that_ends_before_the_first_photograph_is_refused) {
  const auto rig = open_virtual_rig("sim:gummy?size=16x16");
  ASSERT_TRUE(rig.ok());
  CaptureOptions options;
  options.max_seconds = 0.01;
  const auto refused = capture(**rig, options);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::limit);
  EXPECT_TRUE(refused.error().what.starts_with("max_seconds 0.01 is too little")) << refused.error().what;
  EXPECT_TRUE(refused.error().hint.starts_with("give ")) << refused.error().line();
}

TEST(BudgetOfSeconds, is_that_of_each_capture_of_a_rig) {
  const auto rig = open_virtual_rig("sim:gummy?size=32x32");
  ASSERT_TRUE(rig.ok());
  CaptureOptions options;
  options.max_seconds = 4;
  ASSERT_TRUE(capture(**rig, options).ok());
  const double first = (*rig)->cost().rig_seconds;
  const auto second = capture(**rig, options);
  ASSERT_TRUE(second.ok());
  EXPECT_LE((*rig)->cost().rig_seconds - first, 4);
  EXPECT_GT((*rig)->cost().rig_seconds - first, 3);
  EXPECT_LT(second->estimated->frobenius, 0.1);
}

/// Light between pixels goes to near ones most of all, and only the last levels see it. So a budget is spent
/// as a tolerance that is coarser throughout would spend it, not on the first levels. The best such tolerance
/// is the yardstick. A level's own tolerance has steps of 1.5, and each of two levels may be a step too
/// coarse: 1.5².
TEST_F(Budget, a_budget_does_about_what_the_best_coarser_tolerance_does) {
  const DenseTransport large = facing_planes(Grid{32, 32});
  struct Captured {
    std::int64_t patterns;
    double indirect;
  };
  const auto run = [&](const CaptureOptions& options) {
    DenseProbe probe(large);
    const auto result = capture(probe, options);
    EXPECT_TRUE(result.ok());
    return Captured{result->patterns, evaluate(result->tensor, large.truth())->indirect};
  };
  std::vector<Captured> coarser;
  const CaptureOptions base = default_options();
  const double tolerance = default_rule(base.algorithm).flood_fraction;
  for (int steps = 0; steps < 12; ++steps) {
    CaptureOptions options = base;
    options.tolerance = tolerance * std::pow(1.5, steps);
    coarser.push_back(run(options));
  }
  for (const double share : {0.5, 0.7, 0.85}) {
    CaptureOptions options = base;
    options.max_patterns = std::llround(share * static_cast<double>(coarser.front().patterns));
    const Captured bound = run(options);
    double best = 1;
    for (const Captured& one : coarser)
      if (one.patterns <= options.max_patterns) best = std::min(best, one.indirect);
    EXPECT_LE(bound.patterns, options.max_patterns);
    EXPECT_LE(bound.indirect, 1.5 * 1.5 * best) << share << ": " << best;
  }
}

TEST_F(Budget, the_tighter_of_two_is_named) {
  for (const int most : {12, 400}) {
    ClockProbe probe(scene, 1.0);
    CaptureOptions options = default_options();
    options.max_patterns = most;
    options.max_seconds = 20;  // at a second a photograph
    const auto result = capture(probe, options);
    ASSERT_TRUE(result.ok());
    EXPECT_LE(result->patterns, std::min(most, 20));
    EXPECT_EQ(result->stopped_by, most < 20 ? "max_patterns" : "max_seconds");
  }
}

TEST_F(Budget, a_target_is_met_early) {
  const DenseTransport large = facing_planes(Grid{32, 32});
  DenseProbe probe(large), unbound(large);
  CaptureOptions options = default_options();
  const auto all = capture(unbound, options);
  ASSERT_GE(all->error_per_level.size(), 3U);
  // Between what two levels in the middle reach.
  const std::size_t middle = all->error_per_level.size() / 2;
  options.target_error = all->error_per_level[middle] * 1.1;
  ASSERT_GT(all->error_per_level[0], options.target_error);
  const auto result = capture(probe, options);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->stopped_by, "target_error");
  EXPECT_LT(result->patterns, all->patterns);
  ASSERT_TRUE(result->estimated.has_value());
  EXPECT_LE(result->estimated->frobenius, options.target_error);
}

}  // namespace

}  // namespace symrig::budget_test

namespace symrig::progress_test {

// Progress and stops, from the first photograph to the complete tensor.

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

/// A capture with one thread: its events are the same each time. tbb::global_control would not do, because
/// threads that still wait beside an earlier test's work may join this one's.
Result<CaptureResult> capture_alone(Probe& rig, const CaptureOptions& options) {
  Result<CaptureResult> result = Error{ErrorCode::limit, ""};
  tbb::task_arena(1).execute([&] { result = capture(rig, options); });
  return result;
}

Result<CaptureResult> told_by(const tests::DenseTransport& scene, std::vector<Told>& told) {
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
  auto result = capture_alone(rig, options);
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
  result = capture_alone(logged, options);
  return calls;
}

TEST(ProgressOfACapture, stopped_at_any_moment_and_continued_is_the_same) {
  constexpr int kMoments = 20;
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
