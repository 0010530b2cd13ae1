// SPDX-License-Identifier: Apache-2.0
// The engine around a playback: each call holds the board's lock, and asks the board for its time and inputs.
#include "symrig/boards/playback.hpp"

#include <gtest/gtest.h>

namespace symrig::board_common::test::playback_engine_test {
namespace {

constexpr std::uint32_t kInput = 1U << 8U;

/// Counts. A second lock without an unlock in between is an error.
struct CountingMutex {
  void lock() {
    EXPECT_FALSE(held);
    held = true;
    ++count;
  }
  void unlock() { held = false; }
  bool held = false;
  int count = 0;
};

class Engine final : private WordSink, public PlaybackEngine<CountingMutex> {
 public:
  Engine() : PlaybackEngine(*this, {.min_dwell = 1, .lateness = 0, .wait_latency = 5, .input = 0}, 4) {}

  int locks() const { return mutex_.count; }
  bool held() const { return mutex_.held; }
  void act() {
    locked([&] { playback_.act(time); });
  }

  hal::Tick time = 100;
  std::uint32_t inputs_now = 0;
  int inputs_read = 0;

 private:
  hal::Tick put(std::uint32_t /*levels*/) override {
    EXPECT_TRUE(held());
    return time;
  }
  hal::Tick put_all(std::uint32_t levels) override { return put(levels); }
  hal::Tick now() const override {
    EXPECT_TRUE(held());
    return time;
  }
  std::uint32_t inputs() override {
    EXPECT_TRUE(held());
    ++inputs_read;
    return inputs_now;
  }
};

TEST(PlaybackEngine, PlaysInTheTimeOfItsBoard) {
  Engine engine;
  engine.push({5, 10});
  engine.close();
  EXPECT_EQ(engine.start(0), 100U);
  EXPECT_EQ(engine.levels(), 5U);
  engine.time = 110;
  engine.act();
  EXPECT_TRUE(engine.idle());
  EXPECT_EQ(engine.played(), 1U);
  EXPECT_EQ(engine.late(), 0U);
  EXPECT_FALSE(engine.underrun());
}

TEST(PlaybackEngine, EachCallHoldsTheLockOnce) {
  Engine engine;
  hal::WaitOutcome outcome;
  engine.set_safe(0);
  engine.set_trips(kInput, kInput);
  engine.push({1, 10});
  engine.close();
  static_cast<void>(engine.start(0));
  engine.force(3);
  static_cast<void>(engine.room() + engine.levels() + engine.played() + engine.late() + engine.tripped());
  static_cast<void>(engine.idle() || engine.underrun());
  static_cast<void>(engine.underrun());
  static_cast<void>(engine.pop_wait(outcome));
  EXPECT_EQ(engine.locks(), 14);
  EXPECT_FALSE(engine.held());
}

TEST(PlaybackEngine, TripsLookAtTheInputsOnlyIfALineIsWatched) {
  Engine engine;
  engine.inputs_now = kInput;
  engine.set_trips(0, 0);
  EXPECT_EQ(engine.inputs_read, 0);
  engine.set_trips(kInput, kInput);
  EXPECT_EQ(engine.inputs_read, 1);
  EXPECT_EQ(engine.tripped(), kInput);
}

}  // namespace
}  // namespace symrig::board_common::test::playback_engine_test
