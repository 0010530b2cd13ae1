// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/stopwatch.hpp"

#include <gtest/gtest.h>

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
