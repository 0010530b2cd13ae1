// SPDX-License-Identifier: Apache-2.0
// The scene's cameras of GenICam. The one on the network is met by their driver.
#include "assert_ok.hpp"
#include "bench-vm/scene/scene_camera.hpp"
#include "symrig/base/time.hpp"
#include "symrig/camera/internal/genicam_camera.hpp"
#include "usbip/usbip_server.hpp"

#include <any>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace symrig::bench_vm::genicam_scene_camera_test {
namespace {

using namespace std::chrono_literals;
using Taken = CameraPort::Taken;

constexpr Grid kGrid{24, 32};

/// Each process of these tests has another address.
std::string address() {
  return fmt::format("127.9.{}.{}", static_cast<unsigned>(getpid()) >> 8U & 255U, getpid() & 255);
}

std::unique_ptr<SceneCamera> open_scene_camera(double packet_loss = 0, const FaultRates& faults = {}) {
  auto camera = open_gige_camera({address(), kGrid, 3ms, packet_loss}, faults);
  EXPECT_TRUE(camera.ok()) << (camera.ok() ? "" : camera.error().line());
  return camera.ok() ? std::move(*camera) : nullptr;
}

Result<std::unique_ptr<camera::GenicamCamera>> open_driver() {
  camera::GenicamSettings settings;
  settings.device = address();
  settings.format = "Mono12";
  settings.stamp = StampOf::exposure_end;
  return camera::GenicamCamera::open(std::move(settings));
}

/// Frame `number`, whose codes no other frame has.
DeliveredFrame frame_of(std::uint64_t number) {
  std::vector<std::uint16_t> codes(kGrid.size());
  for (std::size_t i = 0; i < codes.size(); ++i)
    codes[i] = static_cast<std::uint16_t>((i + 97 * number) & 4095U);
  DeliveredFrame frame;
  frame.frame = number;
  frame.stamp = steady_now();
  frame.open = Nanoseconds(1'000'000 + 1'000 * static_cast<std::int64_t>(number));
  frame.codes = std::make_shared<const std::vector<std::uint16_t>>(std::move(codes));
  return frame;
}

TEST(GigeSceneCamera, hands_codes_stamps_and_exposures_to_the_driver) {
  const auto scene = open_scene_camera();
  ASSERT_NE(scene, nullptr);
  EXPECT_EQ(scene->deliver(frame_of(0)).value(), Taken::not_streaming);
  EXPECT_FALSE(scene->settings()->follows_pulse);
  const auto driver = open_driver();
  ASSERT_OK(driver);
  EXPECT_TRUE(scene->settings()->follows_pulse);
  EXPECT_FALSE(scene->settings()->stamps_begin);
  EXPECT_EQ((*driver)->timing().readout, 3ms);
  for (std::uint64_t k = 1; k <= 5; ++k) {
    const DeliveredFrame sent = frame_of(k);
    ASSERT_EQ(scene->deliver(sent).value(), Taken::yes);
    const auto frames = (*driver)->take(1, 2s);
    ASSERT_OK(frames);
    ASSERT_EQ(frames->size(), 1U);
    const CameraFrame& seen = frames->front();
    EXPECT_EQ(seen.raw, *sent.codes) << k;
    ASSERT_EQ(seen.stamp_of, StampOf::exposure_end);
    // The driver takes the offset of the clocks, which is 0, from an answer within 200 us.
    EXPECT_NEAR(static_cast<double>((seen.stamp.since - sent.stamp).count()), 0, 1e5);
    const auto* const chunks = std::any_cast<camera::FrameChunks>(&seen.attachment);
    ASSERT_NE(chunks, nullptr);
    EXPECT_EQ(chunks->exposure, sent.open);
  }
}

TEST(GigeSceneCamera, counts_frames_that_were_lost_and_sends_lost_packets_again) {
  const auto scene = open_scene_camera(0.2);
  ASSERT_NE(scene, nullptr);
  const auto driver = open_driver();
  ASSERT_OK(driver);
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t k = 0; k < 30; ++k) {
    DeliveredFrame sent = frame_of(k);
    sent.skip = k == 20 ? 2 : 0;
    ASSERT_EQ(scene->deliver(sent).value(), Taken::yes);
    const auto frames = (*driver)->take(1, 2s);
    ASSERT_OK(frames);
    for (const CameraFrame& seen : *frames) {
      if (seen.damaged) continue;
      EXPECT_EQ(seen.raw, *sent.codes) << k;
      if (k == 19 || k == 20) numbers.push_back(seen.sequence);
    }
  }
  ASSERT_EQ(numbers.size(), 2U) << (*driver)->report().to_string();
  EXPECT_EQ(numbers[1] - numbers[0], 3U);
  EXPECT_EQ(scene->report().find(" 0 sent again"), std::string::npos) << scene->report();
}

TEST(GigeSceneCamera, is_gone_while_it_is_unplugged) {
  const auto scene = open_scene_camera();
  ASSERT_NE(scene, nullptr);
  ASSERT_OK(scene->plug(false));
  EXPECT_EQ(scene->deliver(frame_of(0)).value(), Taken::unplugged);
  EXPECT_FALSE(open_driver().ok());
  ASSERT_OK(scene->plug(true));
  EXPECT_TRUE(open_driver().ok());
}

// Frames that were exposed and delivered as marked: 1 late, 2 swapped, 4 late as the last one but one.
TEST(GigeSceneCamera, delivers_late_and_swapped_frames_with_the_next_one) {
  FaultRates rates;
  rates.late = rates.swap = 0.2;
  const auto scene = open_scene_camera(0, rates);
  ASSERT_NE(scene, nullptr);
  EXPECT_TRUE(scene->delays_frames());
  const auto driver = open_driver();
  ASSERT_OK(driver);
  std::vector<DeliveredFrame> sent;
  for (std::uint64_t k = 0; k < 6; ++k) {
    sent.push_back(frame_of(k));
    if (k == 1 || k == 4) sent.back().fault = FrameFault::late;
    if (k == 2) sent.back().fault = FrameFault::swap;
    ASSERT_EQ(scene->deliver(sent.back()).value(), Taken::yes);
  }
  const auto frames = (*driver)->take(6, 2s);
  ASSERT_OK(frames);
  ASSERT_EQ(frames->size(), 6U);
  constexpr std::array<std::size_t, 6> kOrder{0, 1, 3, 2, 4, 5};
  for (std::size_t k = 0; k < kOrder.size(); ++k) {
    const DeliveredFrame& exposed = sent[kOrder[k]];
    EXPECT_EQ((*frames)[k].raw, *exposed.codes) << k;
    EXPECT_NEAR(static_cast<double>(((*frames)[k].stamp.since - exposed.stamp).count()), 0, 1e5) << k;
  }
  EXPECT_EQ((*frames)[2].sequence, (*frames)[3].sequence + 1);
}

// Without a kernel nobody attaches it. bench.usb3_capture takes whole captures with it.
TEST(Usb3SceneCamera, waits_for_its_host) {
  const auto scene = open_usb3_camera({"U1", kGrid, 3ms, 0}, {});
  ASSERT_OK(scene);
  EXPECT_FALSE((*scene)->settings()->follows_pulse);
  EXPECT_EQ((*scene)->deliver(frame_of(0)).value(), Taken::not_streaming);
  ASSERT_OK((*scene)->plug(false));
  EXPECT_EQ((*scene)->deliver(frame_of(0)).value(), Taken::unplugged);
  ASSERT_OK((*scene)->plug(true));
  EXPECT_EQ((*scene)->deliver(frame_of(0)).value(), Taken::not_streaming);
}

TEST(Usb3SceneCamera, refuses_what_it_cannot_do) {
  FaultRates damaged;
  damaged.damage = 0.1;
  EXPECT_EQ(open_usb3_camera({"U1", kGrid, 3ms, 0}, damaged).error().code, ErrorCode::bad_argument);
  const auto server = test::UsbIpServer(nullptr, 0);
  EXPECT_EQ(open_usb3_camera({"U1", kGrid, 3ms, server.port()}, {}).error().code, ErrorCode::io);
}

TEST(GigeSceneCamera, refuses_what_it_cannot_do) {
  FaultRates twice;
  twice.duplicate = 0.1;
  EXPECT_EQ(open_gige_camera({address(), kGrid, 3ms, 0}, twice).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(open_gige_camera({address(), kGrid, 3ms, 1}, {}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(open_gige_camera({"10.0.0.1", kGrid, 3ms, 0}, {}).error().code, ErrorCode::io);
}

}  // namespace
}  // namespace symrig::bench_vm::genicam_scene_camera_test
