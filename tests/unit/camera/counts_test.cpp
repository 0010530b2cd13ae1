// SPDX-License-Identifier: Apache-2.0
// A driver's numbers and stamps: what is made of them.
#include "symrig/camera/internal/counts.hpp"

#include <chrono>
#include <random>

#include <gtest/gtest.h>
#include <linux/videodev2.h>

namespace symrig::camera::counts_test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kEnd = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
constexpr std::uint32_t kStart = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;

TEST(Sequence, gaps_repeats_and_steps_back_are_told) {
  SequenceCount count;
  EXPECT_EQ(count.read(3).step, CountStep::first);
  EXPECT_EQ(count.read(4).step, CountStep::next);
  const auto gap = count.read(7);
  EXPECT_EQ(gap.step, CountStep::gap);
  EXPECT_EQ(gap.missing, 2U);
  EXPECT_EQ(gap.number, 7U);
  EXPECT_EQ(count.read(7).step, CountStep::repeated);
  const auto back = count.read(5);
  EXPECT_EQ(back.step, CountStep::backwards);
  EXPECT_EQ(back.number, 5U);
  EXPECT_EQ(count.read(6).step, CountStep::next);
}

TEST(Sequence, the_driver_wraps_and_the_count_does_not) {
  SequenceCount count;
  count.read(0xFFFFFFFE);
  EXPECT_EQ(count.read(0xFFFFFFFF).number, 0xFFFFFFFFULL);
  EXPECT_EQ(count.read(0).number, 0x100000000ULL);
  const auto gap = count.read(2);
  EXPECT_EQ(gap.number, 0x100000002ULL);
  EXPECT_EQ(gap.missing, 1U);
}

TEST(Sequence, below_the_first_number_there_is_nothing_to_go_back_to) {
  SequenceCount count;
  count.read(0);
  const auto reading = count.read(0xFFFFFFFF);
  EXPECT_EQ(reading.step, CountStep::gap);
  EXPECT_EQ(reading.number, 0xFFFFFFFFULL);
}

TEST(Sequence, a_restart_leaves_a_gap) {
  SequenceCount count;
  count.restart();  // before the first frame there is nothing to set apart
  EXPECT_EQ(count.read(0).number, 0U);
  EXPECT_EQ(count.read(1).number, 1U);
  count.restart();
  EXPECT_EQ(count.read(0).number, 3U);
}

// Any walk of numbers: the 64-bit count moves as the walk does, and tells exactly the numbers left out.
TEST(Sequence, follows_random_walks_exactly) {
  std::mt19937 random(1);
  for (int walk = 0; walk < 200; ++walk) {
    SequenceCount count;
    std::uint64_t truth = random();
    count.read(static_cast<std::uint32_t>(truth));
    for (int k = 0; k < 200; ++k) {
      const std::uint64_t step = random() % 8 == 0 ? random() % 0x7FFFFFFFU : random() % 3;
      truth += step;
      const auto reading = count.read(static_cast<std::uint32_t>(truth));
      ASSERT_EQ(reading.number, truth);
      ASSERT_EQ(reading.missing, step == 0 ? 0 : step - 1);
      ASSERT_EQ(reading.step == CountStep::repeated, step == 0);
    }
  }
}

StampVerdict judge(StampJudge& judge, Nanoseconds at, Nanoseconds now, std::uint32_t flags = kEnd,
                   bool damaged = false) {
  return judge.judge({at, flags}, now, damaged);
}

TEST(Stamps, flags_tell_begin_and_end) {
  StampJudge j(10s, 0);
  EXPECT_EQ(judge(j, 11s, 11s, kEnd).of, StampOf::exposure_end);
  EXPECT_EQ(judge(j, 12s, 12s, kStart).of, StampOf::exposure_begin);
}

TEST(Stamps, an_unknown_clock_is_never_believed_and_said_once) {
  for (const std::uint32_t flags :
       {std::uint32_t{V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN}, std::uint32_t{V4L2_BUF_FLAG_TIMESTAMP_COPY}}) {
    StampJudge j(10s, 0);
    const auto first = judge(j, 11s, 11s, flags);
    EXPECT_EQ(first.of, StampOf::nothing);
    EXPECT_FALSE(first.note.empty());
    EXPECT_TRUE(judge(j, 12s, 12s, flags).note.empty());
    EXPECT_EQ(judge(j, 13s, 13s, kEnd).of, StampOf::nothing);
  }
}

TEST(Stamps, the_future_convicts_the_clock) {
  StampJudge j(10s, 0);
  EXPECT_EQ(judge(j, 11s + 1ms, 11s).of, StampOf::exposure_end);  // within what a driver may err
  const auto liar = judge(j, 12s + 178ms, 12s);
  EXPECT_EQ(liar.of, StampOf::nothing);
  EXPECT_NE(liar.note.find("178.0 ms"), std::string::npos) << liar.note;
  // Taken late, the next one looks possible: it is not believed.
  EXPECT_EQ(judge(j, 12s + 300ms, 14s).of, StampOf::nothing);
}

TEST(Stamps, frames_from_before_the_stream_are_stale_but_no_more_than_there_were_buffers) {
  StampJudge j(10s, 2);
  EXPECT_TRUE(judge(j, 9s, 10s).stale);
  EXPECT_TRUE(judge(j, 9s + 1ms, 10s).stale);
  const auto third = judge(j, 9s + 2ms, 10s);
  EXPECT_FALSE(third.stale);
  EXPECT_EQ(third.of, StampOf::nothing);
  EXPECT_NE(third.note.find("before the start"), std::string::npos);
}

TEST(Stamps, an_old_frame_of_a_clock_without_a_name_is_stale_too) {
  StampJudge j(10s, 4);
  EXPECT_TRUE(judge(j, 9s, 10s, V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN).stale);
  EXPECT_FALSE(judge(j, 11s, 11s, V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN).stale);
}

TEST(Stamps, after_the_first_good_frame_nothing_is_stale) {
  StampJudge j(10s, 4);
  EXPECT_EQ(judge(j, 11s, 11s).of, StampOf::exposure_end);
  EXPECT_FALSE(judge(j, 9s, 11s).stale);
}

TEST(Stamps, a_stamp_not_after_the_one_before_tells_nothing_and_the_next_does) {
  StampJudge j(10s, 0);
  judge(j, 12s, 12s);
  EXPECT_EQ(judge(j, 12s, 12s).of, StampOf::nothing);
  EXPECT_EQ(judge(j, 11s, 12s).of, StampOf::nothing);
  EXPECT_EQ(judge(j, 11s + 1us, 13s).of, StampOf::exposure_end);
}

TEST(Stamps, a_damaged_frame_convicts_nobody) {
  StampJudge j(10s, 2);
  const auto zero = judge(j, 0s, 11s, kEnd, true);
  EXPECT_FALSE(zero.stale);
  EXPECT_EQ(zero.of, StampOf::nothing);
  EXPECT_TRUE(zero.note.empty());
  EXPECT_EQ(judge(j, 90s, 11s, kEnd, true).of, StampOf::nothing);
  EXPECT_EQ(judge(j, 11s, 11s).of, StampOf::exposure_end);
  EXPECT_EQ(judge(j, 12s, 12s, kEnd, true).of, StampOf::exposure_end);
}

TEST(Stamps, zero_is_no_time) {
  StampJudge j(10s, 4);
  EXPECT_FALSE(judge(j, 0s, 11s).stale);
}

}  // namespace
}  // namespace symrig::camera::counts_test
