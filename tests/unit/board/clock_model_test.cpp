// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/clock_model.hpp"

#include "clock_world.hpp"

#include <array>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::clock_model_test {
namespace {

using namespace std::chrono_literals;
using namespace test;

// Points of the two clocks do not meet: neither minus, nor order, nor a span of the other's kind.
static_assert(std::is_invocable_v<std::minus<>, BoardTime, BoardTime>);
static_assert(std::is_invocable_v<std::less<>, HostTime, HostTime>);
static_assert(std::is_invocable_v<std::plus<>, HostTime, Nanoseconds>);
static_assert(!std::is_invocable_v<std::minus<>, BoardTime, HostTime>);
static_assert(!std::is_invocable_v<std::minus<>, HostTime, BoardTime>);
static_assert(!std::is_invocable_v<std::less<>, BoardTime, HostTime>);
static_assert(!std::is_invocable_v<std::equal_to<>, BoardTime, HostTime>);
static_assert(!std::is_invocable_v<std::plus<>, BoardTime, Nanoseconds>);
static_assert(!std::is_invocable_v<std::plus<>, HostTime, Ticks>);
static_assert(!std::is_convertible_v<BoardTime, HostTime> && !std::is_convertible_v<HostTime, BoardTime>);
static_assert(!std::is_convertible_v<Ticks, BoardTime> && !std::is_convertible_v<Nanoseconds, HostTime>);

#define ASSERT_TAKEN(expression)                        \
  do {                                                  \
    const auto& result_of = (expression);               \
    if (!result_of) FAIL() << result_of.error().line(); \
  } while (false)

constexpr double kTicksPerMicrosecond = 125;

struct Situation {
  std::string name;
  Delays delays;
};

/// USB and worse: jitter of a millisecond each way, one in twenty answers up to 50 ms late.
std::vector<Situation> situations() {
  const Delay quick = uniform(2e-6, 5e-6);
  const Delay late = uniform(0, 50e-3);
  return {{"exponential", {exponential(1e-3), quick, either(exponential(1e-3), 0.05, late)}},
          {"uniform", {uniform(0, 1e-3), quick, either(uniform(0, 1e-3), 0.05, late)}},
          {"one side", {exponential(1e-3), quick, either(uniform(50e-6, 60e-6), 0.05, late)}},
          {"other side", {either(uniform(50e-6, 60e-6), 0.05, late), quick, exponential(1e-3)}},
          {"asymmetric", {exponential(0.1e-3), quick, either(exponential(2e-3), 0.05, late)}},
          {"slow board", {exponential(1e-3), exponential(5e-3), either(exponential(1e-3), 0.05, late)}}};
}

/// 8 readings at once, then one every `interval`, up to `until` seconds.
void ask_until(ClockModel& model, const TrueClock& clock, const Delays& delays, double interval, double until,
               Random& random) {
  double now = 0;
  for (int k = 0; now < until; ++k) {
    const TimeReading reading = ask(clock, delays, now, random);
    ASSERT_TAKEN(model.add(reading));
    now = std::max(in_seconds(reading.received), k < 7 ? 0 : now + interval);
  }
}

TEST(ClockModel, the_bound_holds_and_is_below_200_us_after_ten_seconds) {
  for (const Situation& one : situations()) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      Random random(seed);
      const TrueClock clock{.drift = (random.uniform() * 2 - 1) * 40e-6,
                            .wander_period = 200 + 400 * random.uniform()};
      ClockModel model({125'000'000});
      ask_until(model, clock, one.delays, 0.1, 10, random);
      for (int k = 0; k < 100; ++k) {
        const HostTime time = host_time(10 * random.uniform() + 0.3);
        const auto estimate = model.board_at(time);
        ASSERT_TAKEN(estimate);
        EXPECT_LE(error_of(*estimate, clock, time), static_cast<double>(estimate->bound.count)) << one.name;
      }
      const auto at_ten = model.board_at(host_time(10));
      ASSERT_TAKEN(at_ten);
      EXPECT_LE(static_cast<double>(at_ten->bound.count), 200 * kTicksPerMicrosecond)
          << one.name << " " << seed;
    }
  }
}

/// Any delays, any gaps, any drift and wander within the limits, asked about any time: never outside.
TEST(ClockModel, the_bound_holds_whatever_the_delays) {
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    Random random(seed);
    TrueClock clock{.drift = (random.uniform() * 2 - 1) * 95e-6, .wander = 5e-6 * random.uniform()};
    clock.wander_period = 10 + 1000 * random.uniform();
    ClockModel model({125'000'000}, {.drift = 100e-6, .wander_per_second = clock.steepest() * 1.001});
    const double longest = 1e-5 * std::pow(1e4, random.uniform());
    const Delays delays{exponential(longest), exponential(longest * random.uniform()), uniform(0, longest)};
    double now = 1000 * random.uniform();
    const double begin = now;
    for (int k = 0; k < 60; ++k) {
      const TimeReading reading = ask(clock, delays, now, random);
      ASSERT_TAKEN(model.add(reading));
      now = in_seconds(reading.received) + 3 * random.uniform() * random.uniform();
      const HostTime time = host_time(begin + (now + 50 - begin) * random.uniform());
      const auto estimate = model.board_at(time);
      ASSERT_TAKEN(estimate);
      ASSERT_LE(error_of(*estimate, clock, time), static_cast<double>(estimate->bound.count))
          << seed << " " << k;
      const auto drift = model.drift_at(time);
      ASSERT_TAKEN(drift);
      const double turn = 2 * std::numbers::pi / clock.wander_period;
      const double truth = clock.drift + clock.wander * std::sin(turn * in_seconds(time));
      ASSERT_LE(drift->lowest, truth + 1e-12);
      ASSERT_GE(drift->highest, truth - 1e-12);
    }
  }
}

/// There and back: the host time of a board time is within its bound, also far outside the readings.
TEST(ClockModel, host_times_of_board_times) {
  Random random(7);
  const TrueClock clock;
  ClockModel model({125'000'000});
  ask_until(model, clock, situations()[0].delays, 0.25, 10, random);
  for (int k = 0; k < 200; ++k) {
    const HostTime time = host_time(-20 + 200 * random.uniform());
    const auto estimate = model.host_at(clock.at(in_seconds(time)));
    ASSERT_TAKEN(estimate);
    EXPECT_LE(std::abs((estimate->at - time).count()), estimate->bound.count());
  }
}

/// One reading: half the round trip, and 100 ppm of the age.
TEST(ClockModel, one_reading) {
  ClockModel model({125'000'000});
  ASSERT_TAKEN(model.add({{1s}, {1s + 2ms}, {Ticks{500'000}}, {Ticks{500'000}}}));
  const auto now = model.board_at({1s + 1ms});
  ASSERT_TAKEN(now);
  // Later, the far ends of both sides age by 99.999 and 100.001 s, 100 s in the mean.
  // B(1 s) <= 500001 and B(1.002 s) >= 500000: at 1.001 s, 500000 ± 125000, and 100 ppm of 125000 ticks.
  EXPECT_NEAR(static_cast<double>(now->bound.count), 125'000 * (1 + 100e-6), 3);
  EXPECT_NEAR(static_cast<double>(now->at.since.count), 500'000, 2);
  const auto later = model.board_at({1s + 1ms + 100s});
  ASSERT_TAKEN(later);
  EXPECT_NEAR(static_cast<double>(later->bound.count), 125'000 + 100e-6 * 125e6 * 100, 3);
  const auto drift = model.drift_at({2s});
  ASSERT_TAKEN(drift);
  EXPECT_DOUBLE_EQ(drift->lowest, -100e-6);
  EXPECT_DOUBLE_EQ(drift->highest, 100e-6);
}

/// The time between question and answer that the board itself measured is not part of the doubt.
TEST(ClockModel, a_slow_board_costs_nothing) {
  ClockModel model({125'000'000});
  ASSERT_TAKEN(model.add({{0s}, {10ms}, {Ticks{1000}}, {Ticks{1000 + 1'248'750}}}));  // 10 us on the way
  const auto now = model.board_at({5ms});
  ASSERT_TAKEN(now);
  EXPECT_NEAR(static_cast<double>(now->bound.count), 0.5 * 1250 + 100e-6 * 625'000, 3);
}

/// A question that was sent again is dated by its first sending: wide, and worth nothing beside a good one.
TEST(ClockModel, a_repeated_question_does_no_harm) {
  ClockModel once({125'000'000}), twice({125'000'000});
  const TimeReading good{{0s}, {20us}, {Ticks{1250}}, {Ticks{1250}}};
  const TimeReading repeated{{100ms}, {100ms + 250ms}, {Ticks{26'000'000}}, {Ticks{26'000'000}}};
  ASSERT_TAKEN(once.add(good));
  ASSERT_TAKEN(twice.add(good));
  ASSERT_TAKEN(twice.add(repeated));
  const auto a = once.board_at({400ms});
  const auto b = twice.board_at({400ms});
  ASSERT_TAKEN(a);
  ASSERT_TAKEN(b);
  EXPECT_EQ(a->at, b->at);
  EXPECT_EQ(a->bound, b->bound);
}

/// The same clock, begun anywhere on its circle of 2^64 ticks, gives the same answers.
TEST(ClockModel, wraps_at_2_to_32_63_and_64) {
  for (const std::uint64_t wrap :
       {std::uint64_t{1} << 32U, std::uint64_t{1} << 53U, std::uint64_t{1} << 63U, std::uint64_t{0}}) {
    Random random(3);
    const TrueClock clock{.begin = wrap - 625'000'000};  // 5 s before
    ClockModel model({125'000'000});
    ask_until(model, clock, situations()[0].delays, 0.25, 10, random);
    for (const double seconds : {0.5, 4.999, 5.001, 9.5, 60.0}) {
      const HostTime time = host_time(seconds);
      const auto estimate = model.board_at(time);
      ASSERT_TAKEN(estimate);
      EXPECT_LE(error_of(*estimate, clock, time), static_cast<double>(estimate->bound.count)) << wrap;
      const auto back = model.host_at(clock.at(seconds));
      ASSERT_TAKEN(back);
      EXPECT_LE(std::abs((back->at - time).count()), back->bound.count()) << wrap;
    }
  }
}

TEST(ClockModel, a_restarted_board_is_noticed) {
  Random random(5);
  const TrueClock clock;
  ClockModel model({125'000'000});
  ask_until(model, clock, situations()[0].delays, 0.25, 10, random);
  const auto before = model.board_at({20s});
  const auto back = model.add({{11s}, {11s + 1ms}, {Ticks{1000}}, {Ticks{1000}}});
  ASSERT_FALSE(back.ok());
  EXPECT_EQ(back.error().code, ErrorCode::device_lost);
  EXPECT_NE(back.error().what.find("restarted"), std::string::npos);
  // Restarted long ago, so that its clock has passed where it was: no line fits.
  const auto later = model.add({{1000s}, {1000s + 1ms}, {Ticks{2'000'000'000}}, {Ticks{2'000'000'000}}});
  ASSERT_FALSE(later.ok());
  EXPECT_EQ(later.error().code, ErrorCode::limit);
  const auto after = model.board_at({20s});  // as it was
  ASSERT_TAKEN(before);
  ASSERT_TAKEN(after);
  EXPECT_EQ(before->at, after->at);
  model.forget();
  EXPECT_FALSE(model.board_at({20s}).ok());
  ASSERT_TAKEN(model.add({{1000s}, {1000s + 1ms}, {Ticks{1000}}, {Ticks{1000}}}));
}

/// A clock of 150 ppm under a limit of 100: as soon as the excess is more than the delays hide, it is named.
/// Hidden can be at most a round trip, here 0.2 ms: after 4 s the excess, 50 ppm, is as much.
TEST(ClockModel, too_much_drift_is_named) {
  Random random(9);
  const TrueClock clock{.drift = 150e-6, .wander = 0};
  const Delays delays{uniform(0, 0.1e-3), uniform(0, 0), uniform(0, 0.1e-3)};
  ClockModel model({125'000'000});
  double failed = -1;
  for (int k = 0; k < 40 && failed < 0; ++k) {
    const double now = 0.25 * k;
    const auto taken = model.add(ask(clock, delays, now, random));
    if (!taken.ok()) {
      EXPECT_EQ(taken.error().code, ErrorCode::limit);
      failed = now;
    }
  }
  EXPECT_GT(failed, 0);
  EXPECT_LE(failed, 4.25);
}

TEST(ClockModel, readings_that_contradict_themselves) {
  ClockModel model({125'000'000});
  EXPECT_EQ(model.add({{1s}, {999ms}, {Ticks{5}}, {Ticks{5}}}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(model.add({{1s}, {2s}, {Ticks{5}}, {Ticks{4}}}).error().code, ErrorCode::bad_argument);
  ASSERT_TAKEN(model.add({{1s}, {2s}, {Ticks{5}}, {Ticks{5}}}));
  EXPECT_EQ(model.add({{0s}, {2s}, {Ticks{5}}, {Ticks{5}}}).error().code, ErrorCode::bad_argument);
}

TEST(ClockModel, knows_nothing_before_the_first_reading) {
  const ClockModel model({125'000'000});
  EXPECT_EQ(model.board_at({0s}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(model.host_at({Ticks{0}}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(model.drift_at({0s}).error().code, ErrorCode::bad_argument);
}

/// Hours without a question: the bound is the drift's, and no more.
TEST(ClockModel, after_a_day_the_bound_is_drift_times_age) {
  Random random(11);
  const TrueClock clock{.drift = -60e-6};
  ClockModel model({125'000'000});
  ask_until(model, clock, situations()[0].delays, 0.25, 10, random);
  const HostTime day = host_time(86'400);
  const auto estimate = model.board_at(day);
  ASSERT_TAKEN(estimate);
  EXPECT_LE(error_of(*estimate, clock, day), static_cast<double>(estimate->bound.count));
  EXPECT_LE(static_cast<double>(estimate->bound.count), 100e-6 * 86'400 * 125e6 * 1.001);
}

}  // namespace
}  // namespace symrig::clock_model_test
