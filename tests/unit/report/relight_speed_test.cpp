// SPDX-License-Identifier: Apache-2.0
// That something is measured, and what is done with it. How fast it is is no test's business.
#include "symrig/report/relight_speed.hpp"

#include <array>

#include <gtest/gtest.h>

namespace symrig::relight_speed_test {
namespace {

TransportTensor identity(Grid grid) {
  TensorBuilder builder(BlockTree(grid), 1);
  const std::array<float, 1> one{1};
  for (std::int32_t i = 0; i < grid.size(); ++i) builder.add_scalar(i, i, one);
  return std::move(builder).finish();
}

TEST(RelightSpeed, share_is_bytes_a_second_over_bytes_a_second) {
  const RelightSpeed speed{.array_bytes = 0, .tensor_bytes = 3'000'000, .one = {1, 12e9, 1e-3}, .all = {}};
  EXPECT_NEAR(speed.share_of_triad(speed.one), 0.25, 1e-12);  // 3 GB/s of 12
  EXPECT_EQ(speed.share_of_triad(speed.all), 0);              // not measured
}

TEST(RelightSpeed, measures_one_thread_and_all) {
  const TransportTensor tensor = identity({9, 7});
  int rounds = 0;
  const auto speed = measure_relight(
      tensor, {.array_bytes = 1 << 16, .rounds = 3, .progress = [&rounds](const ProgressEvent&) {
                 ++rounds;
                 return true;
               }});
  ASSERT_TRUE(speed.ok());
  EXPECT_EQ(rounds, 3);
  EXPECT_EQ(speed->array_bytes, 1 << 16);
  EXPECT_EQ(speed->tensor_bytes, tensor.bytes());
  EXPECT_EQ(speed->one.threads, 1);
  EXPECT_GE(speed->all.threads, 1);
  for (const ThreadSpeed& one : {speed->one, speed->all}) {
    EXPECT_GT(one.triad_bytes_per_second, 0);
    EXPECT_GT(one.relight_seconds, 0);
  }
}

TEST(RelightSpeed, can_be_stopped) {
  const auto speed = measure_relight(
      identity({3, 3}),
      {.array_bytes = 1 << 12, .rounds = 3, .progress = [](const ProgressEvent&) { return false; }});
  ASSERT_FALSE(speed.ok());
  EXPECT_EQ(speed.error().code, ErrorCode::interrupted);
}

TEST(RelightSpeed, refuses_what_cannot_be_measured) {
  const auto none = measure_relight(identity({3, 3}), {.array_bytes = 1 << 12, .rounds = 0, .progress = {}});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::bad_argument);
  const auto endless =
      measure_relight(identity({3, 3}), {.array_bytes = std::int64_t{1} << 55, .rounds = 1, .progress = {}});
  ASSERT_FALSE(endless.ok());
  EXPECT_EQ(endless.error().code, ErrorCode::limit);
}

}  // namespace
}  // namespace symrig::relight_speed_test
