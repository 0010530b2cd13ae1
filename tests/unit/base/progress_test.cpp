// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/progress.hpp"

#include "symrig/base/time.hpp"
#include "terminal_line.hpp"

#include <array>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::work_test {
namespace {

struct Told {
  std::string stage;
  std::int64_t done, expected, steps, steps_expected;
  bool computing;
};

class Listener {
 public:
  Progress progress(std::size_t most = 1000) {
    return [this, most](const ProgressEvent& event) {
      told.push_back({std::string(event.stage), event.done, event.expected, event.steps.done,
                      event.steps.expected, event.computing});
      return told.size() < most;
    };
  }
  std::vector<Told> told;
};

TEST(Work, tells_photographs_and_steps_of_each_stage) {
  Listener listener;
  const Work work(listener.progress());
  EXPECT_TRUE(work.tell({"level 1", 4, 8}));
  for (int k = 0; k < 6; ++k) work.add(Work::kStep / 2);
  EXPECT_TRUE(work.tell({"level 1", 8, 8}));
  work.begin("refit", 5 * Work::kStep);
  work.add(2 * Work::kStep);
  const std::vector<Told>& told = listener.told;
  ASSERT_EQ(told.size(), 7U);
  for (std::size_t k = 1; k < 4; ++k) EXPECT_EQ(told[k].steps, static_cast<std::int64_t>(k));
  EXPECT_EQ(told[4].done, 8);
  EXPECT_EQ(told[4].steps, 3) << "the stage goes on";
  EXPECT_EQ(told[5].stage, "refit");
  EXPECT_TRUE(told[5].computing && !told[4].computing);
  EXPECT_EQ(told[6].done, 8) << "photographs stand still";
  EXPECT_EQ(told[6].steps, 2);
  EXPECT_EQ(told[6].steps_expected, 5);
}

TEST(Work, says_no_less_expected_than_done) {
  Listener listener;
  const Work work(listener.progress());
  work.begin("refit", Work::kStep);
  work.add(3 * Work::kStep);
  EXPECT_EQ(listener.told.back().steps_expected, 3);
}

TEST(Work, counts_of_other_threads_are_told_by_its_own) {
  Listener listener;
  const Work work(listener.progress());
  work.begin("refit");
  std::thread([work] {
    Tally tally(work);
    for (int k = 0; k < 1000; ++k) tally.add(Work::kStep / 100);
  }).join();
  EXPECT_EQ(listener.told.size(), 1U) << "a callback of another thread";
  work.look();
  EXPECT_EQ(listener.told.back().steps, 9);  // 1000/100, rounded down
}

TEST(Work, stops_every_thread_that_counts) {
  Listener listener;
  const Work work(listener.progress(2));
  EXPECT_TRUE(work.tell({"level 1", 7, 8}));
  EXPECT_THROW(work.add(Work::kStep), Stopped);
  bool other = false;
  std::thread([&] {
    try {
      work.add(1);
    } catch (const Stopped&) {
      other = true;
    }
  }).join();
  EXPECT_TRUE(other && work.stopped());
  EXPECT_FALSE(work.tell({"level 1", 8, 8}));
  const Result<void> ended = stoppable(work, [&]() -> Result<void> {
    Tally tally(work);
    tally.add(Work::kStep);
    return {};
  });
  ASSERT_FALSE(ended.ok());
  EXPECT_EQ(ended.error().code, ErrorCode::interrupted);
  EXPECT_EQ(ended.error().what, "capture stopped after 8 photographs");
}

TEST(Work, a_callback_that_counts_is_not_called_again) {
  Work* inner = nullptr;
  int calls = 0;
  Work work([&](const ProgressEvent&) {
    ++calls;
    inner->add(2 * Work::kStep);
    return true;
  });
  inner = &work;
  work.add(Work::kStep);
  EXPECT_EQ(calls, 1);
}

TEST(Work, without_anybody_to_tell_does_nothing) {
  const Work work;
  EXPECT_TRUE(work.tell({"level 1", 1, 1}));
  work.begin("refit");
  work.add(Work::kStep);
  work.look();
  EXPECT_FALSE(work.stopped());
}

}  // namespace
}  // namespace symrig::work_test

namespace symrig::time_to_go_test {
namespace {

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

struct Trace {
  std::string name;
  std::vector<Traced> events;
};

/// "# NAME", and then the lines that record_progress has printed.
std::vector<Trace> read_traces() {
  std::ifstream in(SYMRIG_TRACES);
  std::vector<Trace> traces;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("# ")) {
      traces.push_back({line.substr(2), {}});
      continue;
    }
    std::istringstream words(line);
    Traced one;
    words >> one.seconds >> one.done >> one.expected >> one.least >> one.most;
    std::getline(words >> std::ws, one.stage);
    traces.back().events.push_back(one);
  }
  return traces;
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
  int moments = 0, told = 0;
  const std::vector<Trace> traces = read_traces();
  for (const auto& [name, events] : traces) {
    ASSERT_GT(events.size(), 5U) << name;
    const Foretold one = foretold(events);
    EXPECT_EQ(one.wrong, 0) << name << ": " << one.worst;
    moments += one.moments;
    told += one.told;
  }
  EXPECT_GE(traces.size(), 10U);
  EXPECT_GE(3 * told, moments) << told << " of " << moments;  // silence is no answer either
}

}  // namespace
}  // namespace symrig::time_to_go_test

namespace symrig::stopwatch_test {
namespace {

using namespace std::chrono_literals;

/// Until the steady clock has moved on by this much.
void let_pass(Nanoseconds time) {
  for (const Nanoseconds start = steady_now(); steady_now() - start < time;) {
  }
}

TEST(Stopwatch, counts_from_when_it_was_made) {
  const Nanoseconds before = steady_now();
  const Stopwatch watch;
  const Nanoseconds made = steady_now();
  let_pass(20us);
  const Nanoseconds looked = steady_now();
  const Nanoseconds elapsed = watch.elapsed();
  const double seconds = watch.seconds();
  const Nanoseconds after = steady_now();
  EXPECT_GE(elapsed, looked - made);
  EXPECT_LE(elapsed, after - before);
  EXPECT_GE(seconds, 20e-6);
  EXPECT_LE(seconds, symrig::seconds(after - before));
}

TEST(Stopwatch, starts_again_when_a_new_one_is_assigned) {
  Stopwatch watch;
  let_pass(20us);
  const Nanoseconds before = steady_now();
  watch = Stopwatch();
  const Nanoseconds elapsed = watch.elapsed();
  EXPECT_LE(elapsed, steady_now() - before);
}

TEST(Deadline, has_less_left_until_it_has_passed) {
  const Nanoseconds before = steady_now();
  const Deadline far(1h);
  const Nanoseconds left = far.left();
  EXPECT_LE(left, 1h);
  EXPECT_GE(left, 1h - (steady_now() - before));
  EXPECT_FALSE(far.passed());
  const Deadline near(20us);
  let_pass(20us);
  EXPECT_TRUE(near.passed());
  EXPECT_EQ(near.left(), 0ns);
  EXPECT_TRUE(Deadline(0ns).passed());
  EXPECT_EQ(Deadline(-1h).left(), 0ns) << "a moment in the past";
}

}  // namespace
}  // namespace symrig::stopwatch_test

namespace symrig::apps::terminal_line_test {
namespace {

TEST(TerminalLine, a_text_takes_its_letters_not_its_bytes) {
  EXPECT_EQ(columns_of("level 5"), 7U);
  EXPECT_EQ(columns_of("µs ±"), 4U);
  EXPECT_EQ(columns_of("日本"), 4U);
}

TEST(TerminalLine, is_cut_between_letters) {
  EXPECT_EQ(cut_to("µµµ", 2), "µµ");
  EXPECT_EQ(cut_to("日本", 3), "日");
  EXPECT_EQ(cut_to("abc", 0), "");
  EXPECT_EQ(cut_to("abc\xE6", 9), "abc\xE6");  // the rest of a letter is missing
}

TEST(TerminalLine, never_wider_than_asked_for) {
  const std::string text = "symrig capture: Größe 日本語 12 µs";
  for (std::size_t columns = 0; columns < 60; ++columns)
    EXPECT_LE(columns_of(cut_to(text, columns)), columns);
}

TEST(TerminalLine, says_the_longest_that_fits) {
  const std::array<std::string, 3> forms{"level 5, 12 of 318 photographs", "12 of 318 photographs",
                                         "12 of 318"};
  EXPECT_EQ(fitting(forms, 40), forms[0]);
  EXPECT_EQ(fitting(forms, 29), forms[1]);
  EXPECT_EQ(fitting(forms, 20), forms[2]);
  EXPECT_EQ(fitting(forms, 5), "12 of");
}

}  // namespace
}  // namespace symrig::apps::terminal_line_test
