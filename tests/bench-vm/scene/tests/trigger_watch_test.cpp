// SPDX-License-Identifier: Apache-2.0
#include "assert_ok.hpp"
#include "bench-vm/scene/tests/fake_guest.hpp"
#include "bench-vm/scene/watchers.hpp"
#include "symrig/base/time.hpp"

#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::bench_vm::trigger_watch_test {
namespace {

using namespace std::chrono_literals;

/// A watch, in its own thread, on a trace that the test writes.
class Watched : public testing::Test {
 protected:
  void SetUp() override {
    std::thread([this] { allowed_ = set_priority(1).ok(); }).join();
    if (!allowed_) GTEST_SKIP() << "no real-time priority here";
    auto opened = TriggerWatch::open(guest_.places(), 3ms, faults_, stage_);
    ASSERT_OK(opened);
    watch_.emplace(*std::move(opened));
    trace_.open(guest_.places().tracefs + "/trace_pipe", std::ios::app);
    thread_ = std::thread([this] { watch_->run(); });
  }
  void TearDown() override {
    stage_.stop();
    if (thread_.joinable()) thread_.join();
  }
  void set(int gpio, int level, Nanoseconds at) {
    trace_ << fmt::format("  symrigd-7 [000] d..1. {}.{:06}: gpio_value: {} set {}\n", at / 1s,
                          (at % 1s).count() / 1000, gpio, level)
           << std::flush;
  }
  Exposure next() {
    for (;;)
      if (const auto exposure = stage_.next_exposure(0ns, steady_now() + 1s)) return *exposure;
  }

  FakeGuest guest_;
  FaultRates faults_;
  Stage stage_;
  std::optional<TriggerWatch> watch_;
  std::ofstream trace_;
  std::thread thread_;
  bool allowed_ = false;
};

TEST_F(Watched, makes_an_exposure_of_each_pulse) {
  const Nanoseconds start = steady_now();
  set(501, 1, 100ms);  // another line
  set(500, 1, 100ms);
  set(500, 1, 101ms);  // the same level
  set(500, 0, 110ms);
  set(500, 1, 111ms);  // too early
  set(500, 0, 112ms);
  set(500, 1, 120ms);
  set(500, 0, 130ms);
  const Exposure first = next(), second = next();
  EXPECT_EQ(first.frame, 0U);
  EXPECT_EQ(second.frame, 1U);
  EXPECT_GE(first.begin.time, start);  // the strobe's edges, not the trigger's
  EXPECT_GT(first.end.time, first.begin.time);
  EXPECT_GT(second.begin.time, first.end.time);
  TearDown();
  EXPECT_EQ(watch_->missed(), 1U);
  EXPECT_EQ(watch_->exposures(), 2U);
  EXPECT_EQ(guest_.pulled("camera_strobe").substr(0, 9), "pull-down");
  EXPECT_FALSE(stage_.failure());
}

TEST_F(Watched, answers_no_trigger_without_its_cable) {
  stage_.plug_camera(false);
  set(500, 1, 100ms);
  set(500, 0, 110ms);
  set(501, 0, 111ms);
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(guest_.pulled("camera_strobe"), "");
  stage_.plug_camera(true);
  set(500, 1, 120ms);
  set(500, 0, 130ms);
  EXPECT_EQ(next().frame, 0U);
}

// An incomplete truth is useless.
TEST_F(Watched, ends_everything_when_events_were_lost) {
  trace_ << "CPU:0 [LOST 12 EVENTS]\n" << std::flush;
  while (!stage_.stopped()) std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(stage_.failure());
  EXPECT_EQ(stage_.failure()->code, ErrorCode::fault);
}

}  // namespace
}  // namespace symrig::bench_vm::trigger_watch_test
