// SPDX-License-Identifier: Apache-2.0
// Frames on their way from a scripted driver to take(): nothing is lost without a name. Time is the script's,
// but for patience, which is real and never measured.
#include "assert_ok.hpp"
#include "fake_video.hpp"
#include "symrig/camera/v4l2_camera.hpp"
#include "symrig/testing/camera_laws.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <random>
#include <thread>

#include <gtest/gtest.h>

namespace symrig::stream_test {
namespace {

using namespace std::chrono_literals;
using test::FakeCamera;
using test::FakeFrame;
using test::FakeSystem;

constexpr Nanoseconds kStart = 100s;  // FakeCamera's clock when the stream begins
constexpr Nanoseconds kLong = 20s;    // for frames that come: ends a broken test, decides nothing
constexpr Nanoseconds kShort = 20ms;  // for frames that do not come

class Streaming : public testing::Test {
 protected:
  Streaming() {
    system.cameras["/dev/video0"] = camera;
    settings.device = "/dev/video0";
    settings.buffers = 4;
    camera->set_now(kStart);
  }
  void open() {
    auto opened = V4l2Camera::open(settings, system);
    ASSERT_OK(opened);
    host = *std::move(opened);
  }
  /// Frame `sequence`, 10 ms after the one before, all pixels of the value; taken 1 ms later.
  FakeFrame frame(std::uint32_t sequence, unsigned value = 0) {
    FakeFrame frame;
    frame.sequence = sequence;
    frame.stamp = kStart + (sequence + 1) * 10ms;
    for (int k = 0; k < 6 * 8; ++k) {
      frame.bytes.push_back(static_cast<std::byte>(value & 255U));
      frame.bytes.push_back(static_cast<std::byte>(value >> 8));
    }
    camera->set_now(std::max(now, frame.stamp + 1ms));
    now = std::max(now, frame.stamp + 1ms);
    return frame;
  }
  /// Delivers when all buffers are free, so that the driver loses none.
  void deliver(const FakeFrame& frame) {
    camera->await_queued(static_cast<std::size_t>(settings.buffers));
    ASSERT_TRUE(camera->deliver(frame));
  }
  std::vector<CameraFrame> take(std::size_t count, Nanoseconds patience = kLong) {
    auto frames = host->take(count, patience);
    EXPECT_TRUE(frames.ok()) << frames.error().line();
    return frames ? *std::move(frames) : std::vector<CameraFrame>{};
  }

  std::shared_ptr<FakeCamera> camera = std::make_shared<FakeCamera>();
  FakeSystem system;
  CameraSettings settings;
  Nanoseconds now = kStart;
  std::unique_ptr<V4l2Camera> host;  // last: it goes first
};

TEST_F(Streaming, a_v4l2_camera_keeps_the_laws) {
  settings.noise = NoiseModel::from_electrons({});
  settings.bits = NoiseModel::from_electrons({}).bits();
  open();
  ASSERT_NE(host, nullptr);
  expect_camera_laws(*host, [this](std::size_t count) {
    for (std::uint32_t k = 0; k < count; ++k) deliver(frame(k, 7));
  });
}

TEST_F(Streaming, frames_come_in_order_with_pixels_stamps_and_numbers) {
  open();
  for (std::uint32_t k = 0; k < 20; ++k) deliver(frame(k, 1000 + k));
  const auto frames = take(20);
  ASSERT_EQ(frames.size(), 20U);
  for (std::uint32_t k = 0; k < 20; ++k) {
    EXPECT_EQ(frames[k].sequence, k);
    EXPECT_EQ(frames[k].stamp.since, kStart + (k + 1) * 10ms);
    EXPECT_EQ(frames[k].stamp_of, StampOf::exposure_end);
    EXPECT_FALSE(frames[k].damaged);
    EXPECT_EQ(frames[k].raw, std::vector<std::uint16_t>(48, static_cast<std::uint16_t>(1000 + k)));
  }
  const auto report = host->report();
  EXPECT_EQ(report.delivered, 20U);
  EXPECT_EQ(report.missing + report.damaged + report.unstamped + report.errors, 0U);
  EXPECT_EQ(report.to_string(), "20 frames");
}

TEST_F(Streaming, take_waits_for_the_count_or_for_patience) {
  open();
  EXPECT_TRUE(take(1, kShort).empty());
  deliver(frame(0));
  EXPECT_EQ(take(1).size(), 1U);
  deliver(frame(1));
  deliver(frame(2));
  camera->await_queued(4);
  EXPECT_EQ(take(5, kShort).size(), 2U);
  deliver(frame(3));
  deliver(frame(4));
  camera->await_queued(4);
  std::size_t got = 0;  // both are on their way: one call gets them or two do
  while (got < 2) got += take(1).size();
  EXPECT_EQ(got, 2U);
  EXPECT_TRUE(take(0, kLong).empty());
}

TEST_F(Streaming, what_the_driver_loses_is_missing_in_the_numbers) {
  open();
  for (const std::uint32_t k : {0U, 1U, 4U, 5U}) deliver(frame(k));
  const auto frames = take(4);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames[2].sequence, 4U);
  EXPECT_EQ(host->report().missing, 2U);
}

TEST_F(Streaming, what_nobody_takes_is_counted_and_missing_in_the_numbers) {
  settings.waiting = 3;
  open();
  for (std::uint32_t k = 0; k < 5; ++k) deliver(frame(k));
  camera->await_queued(4);
  auto frames = take(3);
  deliver(frame(5));
  for (auto& more : take(1)) frames.push_back(std::move(more));
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames[2].sequence, 2U);
  EXPECT_EQ(frames[3].sequence, 5U);
  EXPECT_EQ(host->report().overflowed, 2U);
  EXPECT_NE(host->report().to_string().find("2 lost because the queue was full"), std::string::npos);
}

TEST_F(Streaming, who_asks_for_more_than_the_queue_holds_makes_room_for_it) {
  settings.waiting = 2;
  open();
  EXPECT_TRUE(take(10, 1ms).empty());
  for (std::uint32_t k = 0; k < 10; ++k) deliver(frame(k));
  EXPECT_EQ(take(10).size(), 10U);
  EXPECT_EQ(host->report().overflowed, 0U);
}

TEST_F(Streaming, repeated_and_reordered_numbers_are_handed_over_and_counted) {
  open();
  for (const std::uint32_t k : {0U, 1U, 1U, 2U, 5U, 3U}) deliver(frame(k));
  const auto frames = take(6);
  ASSERT_EQ(frames.size(), 6U);
  EXPECT_EQ(frames[2].sequence, 1U);
  EXPECT_EQ(frames[2].stamp_of, StampOf::nothing);  // its stamp is that of the frame before
  EXPECT_EQ(frames[5].sequence, 3U);
  EXPECT_EQ(host->report().repeated, 1U);
  EXPECT_EQ(host->report().reordered, 1U);
}

TEST_F(Streaming, frames_in_error_and_short_ones_are_damaged) {
  open();
  FakeFrame marked = frame(0, 9);
  marked.flags |= V4L2_BUF_FLAG_ERROR;
  deliver(marked);
  FakeFrame truncated = frame(1, 9);
  truncated.used = 3 * 16 + 15;
  deliver(truncated);
  FakeFrame empty = frame(2, 9);
  empty.used = 0;
  deliver(empty);
  deliver(frame(3, 9));
  const auto frames = take(4);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_TRUE(frames[0].damaged && frames[1].damaged && frames[2].damaged);
  EXPECT_FALSE(frames[3].damaged);
  EXPECT_EQ(std::count(frames[1].raw.begin(), frames[1].raw.end(), 9), 24);  // three whole rows
  EXPECT_EQ(std::count(frames[2].raw.begin(), frames[2].raw.end(), 0), 48);
  EXPECT_EQ(host->report().damaged, 3U);
}

TEST_F(Streaming, old_frames_are_thrown_away_and_the_jump_after_them_is_no_loss) {
  open();
  FakeFrame old = frame(0);
  old.stamp = kStart - 1s;
  deliver(old);
  deliver(frame(20));
  const auto frames = take(1);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].sequence, 20U);
  EXPECT_EQ(host->report().stale, 1U);
  EXPECT_EQ(host->report().missing, 0U);
}

TEST_F(Streaming, stamps_in_the_future_are_not_used_and_the_report_says_why) {
  open();
  for (std::uint32_t k = 0; k < 3; ++k) {
    FakeFrame f = frame(k);
    f.stamp += 178ms;
    deliver(f);
  }
  const auto frames = take(3);
  ASSERT_EQ(frames.size(), 3U);
  for (const auto& f : frames) EXPECT_EQ(f.stamp_of, StampOf::nothing);
  const auto report = host->report();
  EXPECT_EQ(report.unstamped, 3U);
  EXPECT_EQ(std::count_if(report.notes.begin(), report.notes.end(),
                          [](const auto& note) { return note.find("in the future") != std::string::npos; }),
            1);
}

TEST_F(Streaming, begin_of_exposure_is_told_apart_from_its_end) {
  open();
  FakeFrame f = frame(0);
  f.flags |= V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  deliver(f);
  EXPECT_EQ(take(1).at(0).stamp_of, StampOf::exposure_begin);
}

TEST_F(Streaming, samples_with_more_bits_than_told_are_saturated_and_noted) {
  settings.bits = 12;
  settings.justified = Justified::low;
  open();
  deliver(frame(0, 0x1234));
  EXPECT_EQ(take(1).at(0).raw, std::vector<std::uint16_t>(48, 4095));
  const auto notes = host->report().notes;
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const auto& n) {
    return n.find("bits above the stated 12") != std::string::npos;
  }));
}

TEST_F(Streaming, samples_in_the_upper_bits_come_down) {
  settings.bits = 12;
  settings.noise = NoiseModel::from_electrons({.bits = 12});
  open();
  deliver(frame(0, 0x1230));
  EXPECT_EQ(take(1).at(0).raw, std::vector<std::uint16_t>(48, 0x123));
  EXPECT_TRUE(host->report().notes.empty());
  deliver(frame(1, 0x1231));
  take(1);
  EXPECT_EQ(host->report().notes.size(), 1U);
}

TEST_F(Streaming, a_region_is_binned_and_the_noise_model_with_it) {
  settings.region = {0, 0, {4, 8}, 2};
  settings.noise = NoiseModel::from_electrons({.bits = 16});
  open();
  EXPECT_EQ(host->grid(), (Grid{2, 4}));
  EXPECT_EQ(host->noise(), binned(*settings.noise, 2));
  deliver(frame(0, 100));
  EXPECT_EQ(take(1).at(0).raw, std::vector<std::uint16_t>(8, 100));  // 400 in 18 bits, in 16: 100
}

TEST_F(Streaming, the_multi_planar_calls_serve_as_well) {
  camera->capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  open();
  for (std::uint32_t k = 0; k < 6; ++k) deliver(frame(k, 500 + k));
  const auto frames = take(6);
  ASSERT_EQ(frames.size(), 6U);
  EXPECT_EQ(frames[5].raw, std::vector<std::uint16_t>(48, 505));
}

TEST_F(Streaming, interrupted_and_empty_calls_change_nothing) {
  open();
  camera->fail(VIDIOC_DQBUF, EINTR, 5);
  camera->fail(VIDIOC_QBUF, EINTR, 2);
  deliver(frame(0));
  camera->fail(VIDIOC_DQBUF, EAGAIN, 1);
  deliver(frame(1));
  EXPECT_EQ(take(2).size(), 2U);
  EXPECT_EQ(host->report().errors, 0U);
}

TEST_F(Streaming, an_error_that_passes_is_counted_and_many_in_a_row_end_the_stream) {
  open();
  camera->fail(VIDIOC_DQBUF, EIO, 3);
  deliver(frame(0));
  EXPECT_EQ(take(1).size(), 1U);
  EXPECT_EQ(host->report().errors, 3U);
  camera->fail(VIDIOC_DQBUF, EIO, 100);
  camera->await_queued(4);
  ASSERT_TRUE(camera->deliver(frame(1)));
  const auto lost = host->take(1, kLong);
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().code, ErrorCode::device_lost);
}

TEST_F(Streaming, unplugged_frames_that_came_are_handed_over_first) {
  open();
  deliver(frame(0));
  deliver(frame(1));
  camera->await_queued(4);
  camera->unplug();
  EXPECT_EQ(take(5).size(), 2U);
  const auto lost = host->take(1, kLong);
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().code, ErrorCode::device_lost);
  EXPECT_NE(lost.error().line().find("/dev/video0 (Fake camera) is lost"), std::string::npos)
      << lost.error().line();
  EXPECT_EQ(host->take(1, kShort).error().code, ErrorCode::device_lost);
  EXPECT_EQ(host->set_control("gain", "1").error().code, ErrorCode::device_lost);
  EXPECT_EQ(camera->mapped(), 0);  // closed: only then does its number become free
}

TEST_F(Streaming, unplugged_while_somebody_waits) {
  open();
  std::thread puller([this] {
    std::this_thread::sleep_for(5ms);
    camera->unplug();
  });
  const auto lost = host->take(1, kLong);
  puller.join();
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().code, ErrorCode::device_lost);
}

TEST_F(Streaming, a_queue_in_error_ends_the_stream) {
  open();
  camera->hang_up();
  const auto lost = host->take(1, kLong);
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().code, ErrorCode::device_lost);
}

TEST_F(Streaming, buffers_that_the_driver_does_not_take_back) {
  open();
  camera->fail(VIDIOC_QBUF, EINVAL, 4);
  for (std::uint32_t k = 0; k < 4; ++k) {
    camera->await_queued(4 - k);
    ASSERT_TRUE(camera->deliver(frame(k)));
  }
  std::size_t got = 0;
  auto frames = host->take(4, kLong);
  for (; frames; frames = host->take(4, kLong)) got += frames->size();
  EXPECT_EQ(got, 4U);
  EXPECT_NE(frames.error().line().find("giving a buffer back"), std::string::npos) << frames.error().line();
}

TEST_F(Streaming, a_buffer_that_is_none_is_not_read) {
  open();
  FakeFrame f = frame(0);
  f.index_offset = 4;
  deliver(f);
  EXPECT_EQ(host->take(1, kLong).error().code, ErrorCode::device_lost);
}

TEST_F(Streaming, more_bytes_than_a_buffer_has_are_not_read) {
  open();
  FakeFrame f = frame(0, 3);
  f.used = 1'000'000;
  deliver(f);
  EXPECT_EQ(take(1).at(0).raw, std::vector<std::uint16_t>(48, 3));
}

TEST_F(Streaming, plugged_in_again_it_is_found_under_another_number_and_counts_on) {
  camera->serial = "A7";
  open();
  deliver(frame(0));
  deliver(frame(1));
  take(2);
  camera->unplug();
  ASSERT_FALSE(host->take(1, kLong).ok());
  system.cameras.clear();
  EXPECT_NE(host->reopen().error().line().find("is not back"), std::string::npos);
  auto other = std::make_shared<FakeCamera>();
  other->serial = "B8";
  system.cameras["/dev/video0"] = other;
  EXPECT_FALSE(host->reopen().ok());  // that is another one

  camera = std::make_shared<FakeCamera>();
  camera->serial = "A7";
  camera->bus = "platform:elsewhere";
  camera->set_now(kStart);
  system.cameras["/dev/video5"] = camera;
  ASSERT_OK(host->reopen());
  EXPECT_EQ(host->found().path, "/dev/video5");
  deliver(frame(0));
  const auto frames = take(1);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_GT(frames[0].sequence, 2U);
  EXPECT_EQ(frames[0].stamp_of, StampOf::exposure_end);
  EXPECT_EQ(host->report().delivered, 3U);
}

TEST_F(Streaming, closing_while_frames_come_leaves_nothing_behind) {
  for (int round = 0; round < 20; ++round) {
    now = kStart;
    camera->set_now(kStart);
    open();
    std::thread source([this] {
      for (std::uint32_t k = 0; k < 50; ++k) camera->deliver(frame(k));
    });
    if (round % 2 == 0) take(3, kShort);
    host.reset();
    source.join();
    EXPECT_EQ(camera->mapped(), 0);
    EXPECT_FALSE(camera->streaming());
  }
}

// Any script of faults: each frame that the driver filled is handed over, or counted as one of the things
// that can befall it; numbers and pixels stay together.
TEST_F(Streaming, every_frame_is_accounted_for_under_random_faults) {
  std::mt19937 random(2006);
  settings.waiting = 8;
  for (int run = 0; run < 40; ++run) {
    now = kStart;
    camera->set_now(kStart);
    open();
    std::uint64_t filled = 0, got = 0;
    std::uint32_t sequence = 0;
    for (int k = 0; k < 200; ++k) {
      if (random() % 20 == 0) camera->fail(VIDIOC_DQBUF, random() % 2 == 0 ? EINTR : EIO);
      if (random() % 20 == 0) sequence += static_cast<std::uint32_t>(random() % 3);
      FakeFrame f = frame(sequence, sequence & 0xFFFU);
      if (random() % 10 == 0) f.flags |= V4L2_BUF_FLAG_ERROR;
      if (random() % 10 == 0) f.used = random() % 200;
      filled += camera->deliver(f) ? 1 : 0;
      ++sequence;
      if (random() % 5 != 0) continue;
      for (const CameraFrame& taken : take(1 + random() % 4, 1ms)) {
        ++got;
        if (taken.damaged) continue;
        ASSERT_EQ(taken.raw[0], taken.sequence & 0xFFFU);
      }
    }
    camera->await_queued(4);
    got += take(8, kShort).size();
    const auto report = host->report();
    EXPECT_EQ(report.delivered, got);
    EXPECT_EQ(report.delivered + report.overflowed + report.stale, filled);
    host.reset();
  }
}

}  // namespace
}  // namespace symrig::stream_test
