// SPDX-License-Identifier: Apache-2.0
#include "broken_off.hpp"
#include "dense_scene.hpp"

#include <gtest/gtest.h>

namespace symrig::logged_probe_test {
namespace {

using tests::DenseProbe;
using tests::DenseTransport;
using tests::expect_same;
using tests::facing_planes;
using tests::FailingProbe;
using tests::kNever;

std::vector<Pattern> some_patterns(Grid grid, std::size_t count) {
  std::vector<Pattern> patterns;
  for (std::size_t k = 0; k < count; ++k) {
    patterns.emplace_back(grid);
    patterns.back().values()[k % patterns.back().values().size()] = 1;
  }
  return patterns;
}

TEST(LoggedProbe, logs_what_it_passes_on) {
  const DenseTransport scene = facing_planes({6, 5});
  DenseProbe dense(scene, 0.01);
  DenseProbe twin(scene, 0.01);
  const auto log = make_memory_log(dense.grid(), 1);
  LoggedProbe probe(dense, *log);
  const auto patterns = some_patterns({6, 5}, 7);
  const auto answers = probe.measure(patterns);
  const auto expected = twin.measure(patterns);
  ASSERT_TRUE(answers.ok()) << answers.error().line();
  ASSERT_EQ(answers->size(), 7U);
  ASSERT_EQ(log->size(), 7);
  EXPECT_EQ(probe.replayed(), 0);
  expect_same(probe.cost(), dense.cost());
  for (std::size_t k = 0; k < 7; ++k) {
    EXPECT_EQ((*answers)[k].mean, (*expected)[k].mean);
    EXPECT_EQ(log->photograph(static_cast<std::int64_t>(k))->mean, (*expected)[k].mean);
    EXPECT_EQ(*log->pattern(static_cast<std::int64_t>(k)), patterns[k]);
    EXPECT_EQ(log->spent(static_cast<std::int64_t>(k))->photographs, static_cast<std::int64_t>(k) + 1);
  }
}

TEST(LoggedProbe, asks_for_no_more_at_once_than_may_be_lost) {
  const DenseTransport scene = facing_planes({6, 5});
  DenseProbe dense(scene);
  FailingProbe failing(dense, 6);
  const auto log = make_memory_log(dense.grid(), 1);
  LoggedProbe probe(failing, *log, 3);
  const auto failed = probe.measure(some_patterns({6, 5}, 8));
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::device_lost);
  EXPECT_EQ(failing.asked, (std::vector<std::size_t>{3, 3, 2}));
  EXPECT_EQ(log->size(), 6);
}

TEST(LoggedProbe, refuses_a_log_of_other_patterns) {
  const DenseTransport scene = facing_planes({6, 5});
  DenseProbe dense(scene);
  const auto log = make_memory_log(dense.grid(), 1);
  const auto patterns = some_patterns({6, 5}, 4);
  ASSERT_TRUE(LoggedProbe(dense, *log).measure(patterns).ok());
  const std::vector<Pattern> others{patterns[0], patterns[2]};
  const auto refused = LoggedProbe(dense, *log).measure(others);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_format);
  EXPECT_NE(refused.error().what.find("photograph 1"), std::string::npos) << refused.error().line();
  EXPECT_EQ(log->size(), 4);
}

TEST(LoggedProbe, tells_the_rig_once_what_was_spent_and_counts_on) {
  const DenseTransport scene = facing_planes({6, 5});
  const auto log = make_memory_log({6, 5}, 1);
  const auto patterns = some_patterns({6, 5}, 5);
  DenseProbe first(scene);
  ASSERT_TRUE(LoggedProbe(first, *log).measure(std::span(patterns).first(3)).ok());
  DenseProbe second(scene);
  ASSERT_TRUE(second.measure(std::span(patterns).first(2)).ok());  // a new session's metering
  FailingProbe rig(second, kNever);
  LoggedProbe probe(rig, *log);
  ASSERT_TRUE(probe.measure(std::span(patterns).first(2)).ok());
  EXPECT_EQ(probe.cost().photographs, 2);
  EXPECT_TRUE(rig.continued.empty());
  ASSERT_TRUE(probe.measure(std::span(patterns).subspan(2, 2)).ok());  // one from the log, one new
  ASSERT_TRUE(probe.measure(std::span(patterns).subspan(4)).ok());
  ASSERT_EQ(rig.continued.size(), 1U);
  EXPECT_EQ(rig.continued[0].photographs, 3);
  EXPECT_EQ(rig.asked, (std::vector<std::size_t>{1, 1}));
  EXPECT_EQ(probe.replayed(), 3);
  EXPECT_EQ(probe.cost().photographs, 5);
  EXPECT_EQ(log->size(), 5);
}

TEST(LoggedProbe, a_capture_that_is_broken_off_and_continued_is_the_same) {
  tests::expect_continued_is_the_same("sim:vgroove-textured?size=13x17&noise=off");
}

}  // namespace
}  // namespace symrig::logged_probe_test
