// SPDX-License-Identifier: Apache-2.0
// Lane b: a schedule of sleeps and edges keeps its times in the guest's virtual time, on any computer and
// under any load.
#include "bench-vm/selftest/guest.hpp"

#include <cstdlib>
#include <fstream>

#include <gpiod.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>

namespace symrig::bench_vm::schedule_test {
namespace {

constexpr int kPulses = 1000;
constexpr std::int64_t kPeriod = 1'000'000;  // ns
constexpr std::int64_t kWidth = 100'000;
/// Waking up takes 5 us of virtual time, setting a line through libgpiod 3 to 4 us, and the trace has whole
/// microseconds. A program that needs exact edges must sleep that much less.
constexpr std::int64_t kLatest = 12'000;
/// An answer of the shared folders is an interrupt at a random time. It may delay a few edges of a run, but
/// none by the width of a pulse.
constexpr int kInterrupted = 2 * kPulses / 100;

void be_first() {
  const sched_param priority{.sched_priority = 80};
  ASSERT_EQ(sched_setscheduler(0, SCHED_FIFO, &priority), 0);
  ASSERT_EQ(mlockall(MCL_CURRENT | MCL_FUTURE), 0);
}

/// Writes $BENCH_OUT/edges, nanoseconds since the first edge, to compare two guests.
void save(const std::vector<TracedLevel>& edges) {
  std::ofstream file(place("BENCH_OUT") + "/edges");
  for (const TracedLevel& edge : edges) file << edge.stamp_ns - edges.front().stamp_ns << '\n';
}

TEST(Schedule, keeps_every_edge_in_virtual_time) {
  ASSERT_EQ(place("BENCH_LANE"), "b");
  be_first();
  gpiod_line* output = gpiod_line_find("camera_trigger");
  ASSERT_NE(output, nullptr);
  ASSERT_EQ(gpiod_line_request_output(output, "selftest", 0), 0);
  clear_trace();
  const std::int64_t begin = (now_ns() / kPeriod + 20) * kPeriod;
  for (int i = 0; i < kPulses; ++i) {
    sleep_until(begin + i * kPeriod);
    gpiod_line_set_value(output, 1);
    sleep_until(begin + i * kPeriod + kWidth);
    gpiod_line_set_value(output, 0);
  }
  const auto edges = traced_levels();
  ASSERT_EQ(edges.size(), 2U * kPulses);
  std::int64_t latest = 0;
  int interrupted = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const std::int64_t planned =
        begin + static_cast<std::int64_t>(i / 2) * kPeriod + (i % 2 == 0 ? 0 : kWidth);
    EXPECT_EQ(edges[i].level, i % 2 == 0);
    EXPECT_GE(edges[i].stamp_ns, planned) << i;
    EXPECT_LT(edges[i].stamp_ns, planned + kWidth) << i;
    if (edges[i].stamp_ns > planned + kLatest) ++interrupted;
    latest = std::max(latest, edges[i].stamp_ns - planned);
  }
  EXPECT_LE(interrupted, kInterrupted);
  std::printf("latest edge: %.0f us after its time; %d later than %.0f us\n",
              static_cast<double>(latest) * 1e-3, interrupted, static_cast<double>(kLatest) * 1e-3);
  save(edges);
}

/// A second of sleep in the guest takes less real time, so long waits can be tested.
TEST(Schedule, sleeps_for_as_long_as_asked) {
  const std::int64_t begin = now_ns();
  sleep_until(begin + 30'000'000'000);
  EXPECT_GE(now_ns(), begin + 30'000'000'000);
  EXPECT_LE(now_ns(), begin + 30'010'000'000);
}

}  // namespace
}  // namespace symrig::bench_vm::schedule_test
