// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/time_to_go.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::time_to_go_test {
namespace {

namespace fs = std::filesystem;

TEST(TimeToGo, is_not_told_before_anything_is_known) {
  TimeToGo to_go;
  EXPECT_FALSE(to_go.seconds());
  to_go.report({"level 1", 0, 10, kNoneToCome}, 0);
  EXPECT_FALSE(to_go.seconds());  // no pace
  to_go.report({"level 1", 5, 10}, 5);
  EXPECT_FALSE(to_go.seconds());  // later stages may be long
  to_go.report({"level 1", 6, 0, kNoneToCome}, 6);
  EXPECT_FALSE(to_go.seconds());  // nobody knows of how many
}

TEST(TimeToGo, follows_the_pace_of_a_job_of_one_stage) {
  TimeToGo to_go;
  for (int k = 0; k <= 50; ++k) to_go.report({"Gray code", k, 100, kNoneToCome}, k * 2.0);
  ASSERT_TRUE(to_go.seconds());
  EXPECT_GE(*to_go.seconds(), 100);
  EXPECT_LE(*to_go.seconds(), 140);  // sqrt(100 (1.5 100 + 0.3 100)) = 134
}

// 500 photographs from the log within a second, then one a second.
TEST(TimeToGo, forgets_what_a_log_has_answered) {
  TimeToGo to_go;
  for (int k = 0; k <= 500; ++k) to_go.report({"level 5", k, 600, kNoneToCome}, k * 0.002);
  for (int k = 1; k <= 10; ++k) to_go.report({"level 5", 500 + k, 600, kNoneToCome}, 1.0 + k);
  ASSERT_TRUE(to_go.seconds());
  EXPECT_GT(*to_go.seconds(), 45);
  EXPECT_LT(*to_go.seconds(), 180);
}

TEST(TimeToGo, bounds_that_are_far_apart_are_no_number) {
  TimeToGo to_go;
  to_go.report({"level 1", 0, 10, {10, 20}}, 0);
  to_go.report({"level 1", 5, 10, {10, 20}}, 5);
  EXPECT_TRUE(to_go.seconds());
  to_go.report({"level 1", 6, 10, {10, 100}}, 6);
  EXPECT_FALSE(to_go.seconds());
}

TEST(TimeToGo, the_last_work_is_not_called_nothing) {
  TimeToGo to_go;
  for (int k = 0; k <= 100; ++k) to_go.report({"direct light", k, 100, kNoneToCome}, k);
  EXPECT_FALSE(to_go.seconds());
}

struct Traced {
  double seconds;
  std::int64_t done, expected, least, most;
  std::string stage;
};

std::vector<Traced> read_trace(const fs::path& file) {
  std::ifstream in(file);
  std::vector<Traced> trace;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    Traced one;
    words >> one.seconds >> one.done >> one.expected >> one.least >> one.most;
    std::getline(words >> std::ws, one.stage);
    trace.push_back(one);
  }
  return trace;
}

/// What was told of a real capture, on the computer's clock, after a tenth of it.
struct Foretold {
  int moments = 0, told = 0, wrong = 0;
  std::string worst;
};

Foretold foretold(const std::vector<Traced>& trace) {
  TimeToGo to_go;
  Foretold all;
  const double end = trace.back().seconds;
  for (const Traced& one : trace) {
    to_go.report({one.stage, one.done, one.expected, {one.least, one.most}}, one.seconds);
    if (one.seconds < 0.1 * end || one.stage == "end") continue;
    ++all.moments;
    const auto left = to_go.seconds();
    if (!left) continue;
    ++all.told;
    const double ratio = *left / (end - one.seconds);
    if (ratio >= 0.5 && ratio <= 2) continue;
    ++all.wrong;
    all.worst += one.stage + " " + std::to_string(one.seconds) + " of " + std::to_string(end) + ": " +
                 std::to_string(*left) + "; ";
  }
  return all;
}

// Recorded with record_progress, of scenes, sizes and algorithms of all kinds.
TEST(TimeToGo, is_right_within_a_factor_of_two_in_recorded_captures) {
  int moments = 0, told = 0, traces = 0;
  for (const auto& entry : fs::directory_iterator(SYMRIG_TRACES)) {
    const std::vector<Traced> trace = read_trace(entry.path());
    ASSERT_GT(trace.size(), 5U) << entry.path();
    const Foretold one = foretold(trace);
    EXPECT_EQ(one.wrong, 0) << entry.path() << ": " << one.worst;
    moments += one.moments;
    told += one.told;
    ++traces;
  }
  EXPECT_GE(traces, 10);
  EXPECT_GE(3 * told, moments) << told << " of " << moments;  // silence is no answer either
}

}  // namespace
}  // namespace symrig::time_to_go_test
