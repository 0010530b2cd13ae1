// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/delivery.hpp"

#include "bench-vm/scene/watchers.hpp"

#include <array>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

namespace symrig::bench_vm::delivery_test {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kPeriod = 20ms;

FinishedFrame frame(std::uint64_t number) {
  const Nanoseconds end = static_cast<std::int64_t>(number) * kPeriod;
  return {number, end, end + 3ms,
          std::make_shared<const std::vector<std::uint16_t>>(4, static_cast<std::uint16_t>(number))};
}

std::vector<DeliveredFrame> deliver(const FaultRates& rates, std::uint64_t frames, bool by_camera = false) {
  Delivery delivery(rates, by_camera);
  std::vector<DeliveredFrame> all;
  for (std::uint64_t i = 0; i < frames; ++i) {
    delivery.add(frame(i));
    for (auto& one : delivery.take_due(static_cast<std::int64_t>(i) * kPeriod + 3ms))
      all.push_back(std::move(one));
  }
  while (const auto due = delivery.next_due())
    for (auto& one : delivery.take_due(*due)) all.push_back(std::move(one));
  return all;
}

FaultRates with(double FaultRates::*share, double value) {
  FaultRates rates;
  rates.*share = value;
  return rates;
}

TEST(Delivery, without_faults_hands_everything_over_in_order) {
  const auto all = deliver({}, 50);
  ASSERT_EQ(all.size(), 50U);
  for (std::uint64_t i = 0; i < 50; ++i) {
    EXPECT_EQ(all[i].frame, i);
    EXPECT_EQ(all[i].stamp, frame(i).stamp);
    EXPECT_EQ(all[i].due, frame(i).ready);
    EXPECT_EQ(all[i].skip, 0U);
    EXPECT_FALSE(all[i].damaged);
    EXPECT_EQ(all[i].codes->front(), i);
  }
}

TEST(Delivery, drops_the_frame_that_was_named) {
  FaultRates rates;
  rates.drop_frame = 20;
  const auto all = deliver(rates, 50);
  ASSERT_EQ(all.size(), 49U);
  for (std::uint64_t i = 0; i < 49; ++i) {
    EXPECT_EQ(all[i].frame, i < 20 ? i : i + 1);
    EXPECT_EQ(all[i].skip, i == 20 ? 1U : 0U);
  }
}

TEST(Delivery, is_not_due_before_it_is_read_out) {
  Delivery delivery({});
  delivery.add(frame(1));
  EXPECT_EQ(delivery.next_due(), frame(1).ready);
  EXPECT_TRUE(delivery.take_due(frame(1).ready - 1ns).empty());
  EXPECT_EQ(delivery.take_due(frame(1).ready).size(), 1U);
  EXPECT_EQ(delivery.next_due(), std::nullopt);
}

// A dropped frame leaves a gap in the numbers if the camera counts, and none if it does not.
TEST(Delivery, drops_frames_with_and_without_a_gap) {
  FaultRates rates = with(&FaultRates::drop, 0.3);
  for (const bool counted : {true, false}) {
    rates.counted = counted;
    const auto all = deliver(rates, 400);
    std::uint64_t next = 0, dropped = 0;
    for (const DeliveredFrame& one : all) {
      EXPECT_EQ(one.skip, counted ? one.frame - next : 0);
      dropped += one.frame - next;
      next = one.frame + 1;
    }
    EXPECT_NEAR(static_cast<double>(dropped), 120, 5 * std::sqrt(400 * 0.3 * 0.7));
  }
}

TEST(Delivery, duplicates_frames_with_their_stamp) {
  const auto all = deliver(with(&FaultRates::duplicate, 1), 20);
  ASSERT_EQ(all.size(), 40U);
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(all[i].frame, i / 2);
    EXPECT_EQ(all[i].stamp, frame(i / 2).stamp);
  }
}

// A late frame arrives late and has a late stamp. Frames behind it wait.
TEST(Delivery, delays_frames_and_what_waits_behind_them) {
  FaultRates rates = with(&FaultRates::late, 0.2);
  rates.late_by = 50ms;
  const auto all = deliver(rates, 300);
  ASSERT_EQ(all.size(), 300U);
  Nanoseconds before{};
  int late = 0;
  for (std::uint64_t i = 0; i < 300; ++i) {
    EXPECT_EQ(all[i].frame, i);
    const bool is_late = all[i].fault == FrameFault::late;
    late += is_late ? 1 : 0;
    EXPECT_EQ(all[i].stamp, frame(i).stamp + (is_late ? 50ms : 0ms));
    EXPECT_GE(all[i].due, frame(i).ready + (is_late ? 50ms : 0ms));
    EXPECT_GE(all[i].due, before);
    before = all[i].due;
  }
  EXPECT_NEAR(late, 60, 5 * std::sqrt(300 * 0.2 * 0.8));
}

TEST(Delivery, swaps_a_frame_with_the_one_after_it) {
  const auto all = deliver(with(&FaultRates::swap, 0.1), 300);
  ASSERT_EQ(all.size(), 300U);
  int swapped = 0;
  for (std::size_t i = 0; i + 1 < 300; ++i) {
    if (all[i].frame < all[i + 1].frame) continue;
    EXPECT_EQ(all[i].frame, all[i + 1].frame + 1);
    EXPECT_EQ(all[i + 1].fault, FrameFault::swap);
    ++swapped;
  }
  EXPECT_GT(swapped, 10);
}

// A camera that delays and swaps frames itself gets them as they were exposed, and is told.
TEST(Delivery, leaves_late_and_swapped_frames_to_a_camera_that_makes_them) {
  FaultRates rates = with(&FaultRates::late, 0.2);
  rates.swap = 0.2;
  rates.drop = 0.1;
  const auto all = deliver(rates, 300, true);
  std::map<FrameFault, int> faults;
  std::uint64_t next = 0;
  for (const DeliveredFrame& one : all) {
    EXPECT_EQ(one.frame, next + one.skip);
    EXPECT_EQ(one.stamp, frame(one.frame).stamp);
    EXPECT_EQ(one.due, frame(one.frame).ready);
    EXPECT_EQ(one.fault, fault_of(rates, one.frame));
    ++faults[one.fault];
    next = one.frame + 1;
  }
  EXPECT_NEAR(faults[FrameFault::late], 60, 5 * std::sqrt(300 * 0.2 * 0.8));
  EXPECT_NEAR(faults[FrameFault::swap], 60, 5 * std::sqrt(300 * 0.2 * 0.8));
}

// The last frame has no successor, and is delivered anyway.
TEST(Delivery, does_not_keep_the_last_frame) {
  const auto all = deliver(with(&FaultRates::swap, 1), 1);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_GT(all[0].due, frame(0).ready);
}

TEST(Delivery, tears_and_marks_damaged_frames) {
  const auto all = deliver(with(&FaultRates::damage, 1), 3);
  EXPECT_TRUE(all[2].damaged);
  EXPECT_EQ(*all[2].codes, (std::vector<std::uint16_t>{2, 2, 0, 0}));
}

// Shares and jitter over many frames, within 5 sigmas. Equal seeds give equal faults.
TEST(FrameFaults, come_as_often_as_asked_for) {
  FaultRates rates{.drop = 0.01, .duplicate = 0.005, .late = 0.01, .swap = 0.002, .damage = 0.003};
  rates.jitter = 100us;
  constexpr int kFrames = 200'000;
  std::map<FrameFault, int> count;
  double squares = 0;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    ++count[fault_of(rates, i)];
    squares += std::pow(seconds(jitter_of(rates, i)) / 100e-6, 2);
    ASSERT_EQ(fault_of(rates, i), fault_of(rates, i));
  }
  const std::array<std::pair<FrameFault, double>, 5> asked{{{FrameFault::drop, 0.01},
                                                            {FrameFault::duplicate, 0.005},
                                                            {FrameFault::late, 0.01},
                                                            {FrameFault::swap, 0.002},
                                                            {FrameFault::damage, 0.003}}};
  for (const auto& [fault, share] : asked)
    EXPECT_NEAR(count[fault], share * kFrames, 5 * std::sqrt(share * kFrames)) << name(fault);
  EXPECT_NEAR(squares / kFrames, 1, 5 * std::sqrt(2.0 / kFrames));
  rates.drop_trigger = 0.004;
  int unseen = 0;
  for (std::uint64_t i = 0; i < kFrames; ++i) unseen += sees_trigger(rates, i) ? 0 : 1;
  EXPECT_NEAR(unseen, 0.004 * kFrames, 5 * std::sqrt(0.004 * kFrames));
  FaultRates other = rates;
  other.seed = 2;
  int differ = 0;
  for (std::uint64_t i = 0; i < 1000; ++i) differ += fault_of(rates, i) != fault_of(other, i) ? 1 : 0;
  EXPECT_GT(differ, 20);
}

TEST(FrameFaults, knows_shares_that_cannot_be) {
  EXPECT_TRUE(FaultRates{}.valid());
  EXPECT_FALSE(with(&FaultRates::drop, -0.1).valid());
  EXPECT_FALSE(with(&FaultRates::late, std::nan("")).valid());
  EXPECT_FALSE(with(&FaultRates::drop_trigger, 1.1).valid());
  FaultRates much = with(&FaultRates::drop, 0.6);
  much.duplicate = 0.6;
  EXPECT_FALSE(much.valid());
}

using Move = Shutter::Move;

TEST(Shutter, is_open_while_the_trigger_is_high) {
  Shutter shutter(3ms);
  EXPECT_EQ(shutter.trigger(false, 1ms), Move::none);  // it was low
  EXPECT_EQ(shutter.trigger(true, 2ms), Move::open);
  EXPECT_EQ(shutter.trigger(true, 3ms), Move::none);  // the same level set again
  EXPECT_TRUE(shutter.is_open());
  EXPECT_EQ(shutter.trigger(false, 5ms), Move::close);
  EXPECT_FALSE(shutter.is_open());
  EXPECT_EQ(shutter.trigger(true, 8ms), Move::open);  // exactly at the end of the readout
}

TEST(Shutter, misses_a_trigger_during_readout_and_its_end) {
  Shutter shutter(3ms);
  shutter.trigger(true, 2ms);
  shutter.trigger(false, 5ms);
  EXPECT_EQ(shutter.trigger(true, 7'999'999ns), Move::none);
  EXPECT_EQ(shutter.trigger(false, 20ms), Move::none);  // late enough, but it never opened
  EXPECT_EQ(shutter.missed(), 1U);
  EXPECT_EQ(shutter.trigger(true, 21ms), Move::open);
}

TEST(Shutter, stays_closed_for_a_trigger_that_the_camera_does_not_see) {
  Shutter shutter(3ms);
  EXPECT_EQ(shutter.trigger(true, 2ms, false), Move::none);
  EXPECT_EQ(shutter.trigger(true, 3ms), Move::none);  // the same level set again
  EXPECT_EQ(shutter.trigger(false, 5ms), Move::none);
  EXPECT_EQ(shutter.trigger(true, 6ms), Move::open);           // there is nothing to read out
  EXPECT_EQ(shutter.trigger(false, 7ms, false), Move::close);  // only a rising edge can be overlooked
  EXPECT_EQ(shutter.triggers(), 2U);
  EXPECT_EQ(shutter.unseen(), 1U);
  EXPECT_EQ(shutter.missed(), 0U);
}

}  // namespace
}  // namespace symrig::bench_vm::delivery_test
