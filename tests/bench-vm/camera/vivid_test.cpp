// SPDX-License-Identifier: Apache-2.0
// V4l2Camera with vivid, the kernel's test driver, which was written independently. It makes faults on
// request: bad buffers, dropped buffers, wrapping numbers, fatal errors, a disconnect.
#include "assert_ok.hpp"
#include "bench-vm/selftest/guest.hpp"
#include "symrig/camera/v4l2_camera.hpp"

#include <algorithm>
#include <chrono>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace symrig::bench_vm::vivid_test {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kLong = 60s;  // time-out for a broken test; has no effect otherwise

CameraSettings small(const std::string& format = "Y16") {
  CameraSettings settings;
  settings.device = place("BENCH_VIVID");
  settings.format = format;
  // Small and slow. If vivid's thread cannot draw a picture in one period, it never sleeps again, and every
  // call waits for its lock. The kernel then warns of a "wrong timeout value".
  settings.size = {180, 320};
  settings.rate = 10;
  // Resets what an earlier test has set.
  settings.controls = {{"timestamp_source", "End of Frame"},
                       {"percentage_of_dropped_buffers", "0"},
                       {"wrap_sequence_number", "off"},
                       {"gain_automatic", "off"},
                       {"gain", "100"}};
  return settings;
}

std::vector<CameraFrame> take(V4l2Camera& camera, std::size_t count) {
  std::vector<CameraFrame> all;
  while (all.size() < count) {
    auto frames = camera.take(count - all.size(), kLong);
    EXPECT_TRUE(frames.ok()) << frames.error().line();
    if (!frames || frames->empty()) break;
    std::move(frames->begin(), frames->end(), std::back_inserter(all));
  }
  EXPECT_GE(all.size(), count);
  return all;
}

TEST(Vivid, every_linear_format_streams_with_codes_of_its_depth) {
  const auto info = look_at_camera(place("BENCH_VIVID"));
  ASSERT_OK(info);
  std::set<std::string> read;
  for (const FormatOffer& offer : info->formats) {
    if (offer.format == nullptr) continue;
    auto camera = V4l2Camera::open(small(offer.name()));
    ASSERT_OK(camera);
    const auto frames = take(**camera, 3);
    for (std::size_t k = 1; k < frames.size(); ++k)
      EXPECT_GT(frames[k].sequence, frames[k - 1].sequence) << offer.name();
    const auto [least, most] = std::minmax_element(frames[0].raw.begin(), frames[0].raw.end());
    EXPECT_LT(*least, *most) << offer.name();  // colour bars
    EXPECT_LT(*most, 1U << offer.format->bits) << offer.name();
    const auto notes = (*camera)->report().notes;
    EXPECT_TRUE(std::none_of(notes.begin(), notes.end(),
                             [](const auto& n) { return n.find("samples have") != std::string::npos; }));
    read.insert(offer.name());
  }
  for (const char* name : {"GREY", "Y10", "Y12", "Y16", "SRGGB8", "SBGGR10", "SGRBG12", "SGBRG16", "YUYV"})
    EXPECT_TRUE(read.contains(name)) << name;
}

TEST(Vivid, stamps_of_the_end_of_frames_lie_in_the_future_and_are_not_used) {
  auto camera = V4l2Camera::open(small());
  ASSERT_OK(camera);
  for (const CameraFrame& frame : take(**camera, 5)) EXPECT_EQ(frame.stamp_of, StampOf::nothing);
  const auto notes = (*camera)->report().notes;
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(),
                          [](const auto& n) { return n.find("in the future") != std::string::npos; }));
}

TEST(Vivid, stamps_of_the_start_of_exposures_are_used) {
  auto settings = small();
  settings.controls[0].value = "Start of Exposure";
  auto camera = V4l2Camera::open(settings);
  ASSERT_OK(camera);
  const auto frames = take(**camera, 5);
  for (const CameraFrame& frame : frames) EXPECT_EQ(frame.stamp_of, StampOf::exposure_begin);
}

TEST(Vivid, dropped_buffers_are_missing_numbers) {
  auto settings = small();
  settings.controls[1].value = "50";
  auto camera = V4l2Camera::open(settings);
  ASSERT_OK(camera);
  const auto frames = take(**camera, 20);
  const auto report = (*camera)->report();
  // 20 frames without a loss have a probability of 2^-19.
  EXPECT_GT(report.missing, 0U);
  EXPECT_EQ(frames.back().sequence - frames.front().sequence + 1,
            frames.size() + report.missing - (report.delivered - frames.size()));
}

TEST(Vivid, numbers_that_wrap_go_on) {
  auto settings = small();
  settings.controls[2].value = "on";
  auto camera = V4l2Camera::open(settings);
  ASSERT_OK(camera);
  const auto frames = take(**camera, 140);  // it begins 128 before the end
  EXPECT_GT(frames.back().sequence, 0xFFFFFFFFULL);
  for (std::size_t k = 1; k < frames.size(); ++k) EXPECT_GT(frames[k].sequence, frames[k - 1].sequence);
  EXPECT_EQ((*camera)->report().reordered, 0U);
}

TEST(Vivid, a_buffer_in_error_is_a_damaged_frame) {
  auto camera = V4l2Camera::open(small());
  ASSERT_OK(camera);
  take(**camera, 2);
  ASSERT_OK((*camera)->set_control("inject_v4l2_buf_flag_error", "1"));
  bool damaged = false;
  for (int k = 0; k < 20 && !damaged; ++k)
    for (const CameraFrame& frame : take(**camera, 1)) damaged = damaged || frame.damaged;
  EXPECT_TRUE(damaged);
  EXPECT_GE((*camera)->report().damaged, 1U);
}

/// The camera is lost now. Drops the frames that came before.
void expect_lost(V4l2Camera& camera) {
  auto frames = camera.take(1, kLong);
  while (frames && !frames->empty()) frames = camera.take(1, kLong);
  ASSERT_FALSE(frames.ok());
  EXPECT_EQ(frames.error().code, ErrorCode::device_lost) << frames.error().line();
}

TEST(Vivid, a_fatal_error_of_the_stream_ends_it_and_it_opens_again) {
  auto camera = V4l2Camera::open(small());
  ASSERT_OK(camera);
  take(**camera, 2);
  ASSERT_OK((*camera)->set_control("inject_fatal_streaming_error", "1"));
  expect_lost(**camera);
  ASSERT_OK((*camera)->reopen());
  take(**camera, 2);
}

TEST(Vivid, disconnected_while_streaming_it_is_lost_and_comes_back) {
  auto camera = V4l2Camera::open(small());
  ASSERT_OK(camera);
  for (int round = 0; round < 5; ++round) {
    take(**camera, 2);
    // The driver accepts the button, or has no node any more.
    const auto pressed = (*camera)->set_control("disconnect", "1");
    EXPECT_TRUE(pressed.ok() || pressed.error().code == ErrorCode::device_lost);
    expect_lost(**camera);
    ASSERT_OK((*camera)->reopen());  // vivid connects again when the last user closes it
  }
  EXPECT_EQ((*camera)->report().restarts, 5U);
}

TEST(Vivid, faults_of_starting_are_errors_and_leave_nothing_held) {
  auto camera = V4l2Camera::open(small());
  ASSERT_OK(camera);
  for (const char* fault : {"inject_vidioc_reqbufs_error", "inject_vidioc_streamon_error"}) {
    ASSERT_OK((*camera)->set_control(fault, "1"));
    EXPECT_FALSE((*camera)->reopen().ok()) << fault;
    ASSERT_OK((*camera)->reopen());
    take(**camera, 1);
  }
}

}  // namespace
}  // namespace symrig::bench_vm::vivid_test
