// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/work.hpp"

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
