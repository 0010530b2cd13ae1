// SPDX-License-Identifier: Apache-2.0
// The scene's camera on the network, met by the driver of GenICam cameras.
#include "bench-vm/scene/gige_scene_camera.hpp"

#include "assert_ok.hpp"
#include "camera/genicam/genicam_camera.hpp"
#include "symrig/base/stopwatch.hpp"

#include <any>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace symrig::bench_vm::gige_scene_camera_test {
namespace {

using namespace std::chrono_literals;
using Taken = CameraPort::Taken;

constexpr Grid kGrid{24, 32};

/// Each process of these tests has another address.
std::string address() {
  return fmt::format("127.9.{}.{}", static_cast<unsigned>(getpid()) >> 8U & 255U, getpid() & 255);
}

std::unique_ptr<SceneCamera> open_scene_camera(double packet_loss = 0) {
  auto camera = open_gige_camera({address(), kGrid, 3ms, packet_loss}, {});
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

TEST(GigeSceneCamera, refuses_what_it_cannot_do) {
  FaultRates late;
  late.late = 0.1;
  EXPECT_EQ(open_gige_camera({address(), kGrid, 3ms, 0}, late).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(open_gige_camera({address(), kGrid, 3ms, 1}, {}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(open_gige_camera({"10.0.0.1", kGrid, 3ms, 0}, {}).error().code, ErrorCode::io);
}

}  // namespace
}  // namespace symrig::bench_vm::gige_scene_camera_test
