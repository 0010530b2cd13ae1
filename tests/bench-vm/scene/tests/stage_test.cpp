// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/stage.hpp"

#include "symrig/base/time.hpp"

#include <thread>

#include <gtest/gtest.h>

namespace symrig::bench_vm::stage_test {
namespace {

using namespace std::chrono_literals;

TEST(Stage, hands_exposures_on_in_order_once_they_are_ripe) {
  Stage stage;
  const Nanoseconds now = steady_now();
  stage.exposed({0, {now - 3s, 0ns}, {now - 2s, 0ns}});
  stage.exposed({1, {now - 1s, 0ns}, {now + 1h, 0ns}});
  ASSERT_TRUE(stage.next_exposure(1s, now));
  EXPECT_EQ(stage.next_exposure(1s, now), std::nullopt);
}

// Called from other threads, like the watchers: nothing is lost, and stop() wakes waiting threads.
TEST(Stage, is_told_by_other_threads) {
  Stage stage;
  const Nanoseconds now = steady_now();
  std::thread watcher([&stage, now] {
    for (std::uint64_t i = 0; i < 500; ++i) {
      stage.show(now + Nanoseconds{static_cast<std::int64_t>(i)},
                 std::make_shared<const Image<float>>(Grid{1, 1}, 1, static_cast<float>(i)));
      stage.exposed({i, {now - 2s, 0ns}, {now - 1s, 0ns}});
    }
    stage.stop(Error{ErrorCode::fault, "first", ""});
    stage.stop(Error{ErrorCode::io, "second", ""});
  });
  std::uint64_t next = 0;
  while (next < 500) {
    const auto exposure = stage.next_exposure(0ns, now + 1h);
    if (!exposure) continue;
    EXPECT_EQ(exposure->frame, next);
    ++next;
  }
  watcher.join();
  EXPECT_TRUE(stage.stopped());
  ASSERT_TRUE(stage.failure());
  EXPECT_EQ(stage.failure()->what, "first");
  EXPECT_EQ(stage.newest().number, 499U);
  EXPECT_EQ(stage.next_exposure(0ns, now + 1h), std::nullopt);  // does not wait, because it was stopped
}

}  // namespace
}  // namespace symrig::bench_vm::stage_test
