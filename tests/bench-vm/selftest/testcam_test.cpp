// SPDX-License-Identifier: Apache-2.0
// The test camera: injected frames arrive complete, and it makes the faults of real cameras on request.
#include "bench-vm/selftest/guest.hpp"
#include "bench-vm/selftest/testcam_client.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <random>
#include <thread>

#include <gtest/gtest.h>

namespace symrig::bench_vm::testcam_test {
namespace {

std::vector<std::byte> noise(std::size_t bytes, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::byte> pixels(bytes);
  for (std::byte& byte : pixels) byte = static_cast<std::byte>(random());
  return pixels;
}

std::int64_t stamp_of(const v4l2_buffer& buffer) {
  return buffer.timestamp.tv_sec * 1'000'000'000 + buffer.timestamp.tv_usec * 1'000;
}

/// Waits for the camera's node. udev makes it a moment after the plug. It has another number if a program
/// (perhaps udev) still has the old one open. Empty if it does not come.
std::string find_camera() {
  for (int i = 0; i < 1000; ++i) {
    for (const auto& entry : std::filesystem::directory_iterator("/sys/class/video4linux")) {
      std::string node = "/dev/" + entry.path().filename().string();
      if (read_text(entry.path() / "name") == "testcam\n" && Stream(node).ok()) return node;
    }
    sleep_until(now_ns() + 10'000'000);
  }
  return "";
}

class Testcam : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(injector_.state().plugged, 1U);
    ASSERT_NE(camera_, "");
  }

  /// Starts a stream of small frames.
  static std::vector<std::byte> small(Stream& stream, std::uint32_t queued = 4) {
    const auto format = stream.set_format(V4L2_PIX_FMT_Y16, 64, 48);
    EXPECT_EQ(stream.start(queued), 0);
    return noise(format.sizeimage, 1);
  }

  Injector injector_;
  std::string camera_ = find_camera();
};

TEST_F(Testcam, hands_over_every_format_and_size_unchanged) {
  const std::array formats{V4L2_PIX_FMT_GREY,    V4L2_PIX_FMT_Y10,     V4L2_PIX_FMT_Y12,
                           V4L2_PIX_FMT_Y16,     V4L2_PIX_FMT_SRGGB8,  V4L2_PIX_FMT_SGBRG10,
                           V4L2_PIX_FMT_SGRBG12, V4L2_PIX_FMT_SBGGR16, V4L2_PIX_FMT_YUYV};
  const std::array sizes{std::array{8U, 8U}, std::array{642U, 482U}, std::array{1920U, 1200U}};
  unsigned seed = 0;
  for (const std::uint32_t fourcc : formats) {
    for (const auto& [width, height] : sizes) {
      Stream stream(camera_);
      const auto format = stream.set_format(fourcc, width, height);
      ASSERT_EQ(format.pixelformat, fourcc);
      ASSERT_EQ(format.width, width);
      ASSERT_EQ(format.height, height);
      ASSERT_EQ(stream.start(), 0);
      const auto pixels = noise(format.sizeimage, ++seed);
      ASSERT_EQ(injector_.frame({}, pixels), 0);
      const auto buffer = stream.take();
      ASSERT_TRUE(buffer);
      EXPECT_TRUE(std::ranges::equal(stream.pixels(*buffer), pixels)) << "format " << fourcc << ", " << width;
    }
  }
}

TEST_F(Testcam, stamps_as_it_is_told_and_says_of_what) {
  for (const bool start : {false, true}) {
    ASSERT_TRUE(write_text("/sys/module/testcam/parameters/stamp_of_start", start ? "1" : "0"));
    ASSERT_EQ(injector_.unplug(), 0);
    ASSERT_EQ(injector_.plug(), 0);
    Stream stream(find_camera());
    ASSERT_TRUE(stream.ok());
    const auto pixels = small(stream);
    const std::int64_t stamp = now_ns() - 123'456'000;
    ASSERT_EQ(injector_.frame({static_cast<std::uint64_t>(stamp), 0, 0}, pixels), 0);
    const auto buffer = stream.take();
    ASSERT_TRUE(buffer);
    EXPECT_EQ(stamp_of(*buffer), stamp / 1000 * 1000);
    EXPECT_EQ(buffer->flags & V4L2_BUF_FLAG_TIMESTAMP_MASK, unsigned{V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC});
    EXPECT_EQ(buffer->flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK,
              start ? unsigned{V4L2_BUF_FLAG_TSTAMP_SRC_SOE} : unsigned{V4L2_BUF_FLAG_TSTAMP_SRC_EOF});
  }
}

TEST_F(Testcam, skips_numbers_and_marks_damage) {
  Stream stream(camera_);
  const auto pixels = small(stream);
  const std::array heads{testcam_frame{0, 0, 0}, testcam_frame{0, 3, 0}, testcam_frame{0, 0, TESTCAM_DAMAGED},
                         testcam_frame{0, 0, 0}};
  for (const testcam_frame& head : heads) ASSERT_EQ(injector_.frame(head, pixels), 0);
  const std::array<std::uint32_t, 4> numbers{0, 4, 5, 6};
  for (std::size_t i = 0; i < heads.size(); ++i) {
    const auto buffer = stream.take();
    ASSERT_TRUE(buffer);
    EXPECT_EQ(buffer->sequence, numbers.at(i));
    EXPECT_EQ((buffer->flags & V4L2_BUF_FLAG_ERROR) != 0, heads.at(i).flags != 0) << i;
  }
}

TEST_F(Testcam, loses_frames_that_find_no_buffer_and_counts_on) {
  Stream stream(camera_);
  const auto pixels = small(stream, 2);
  for (int i = 0; i < 5; ++i) ASSERT_EQ(injector_.frame({}, pixels), 0);
  EXPECT_EQ(injector_.state().lost, 3U);
  for (const std::uint32_t number : {0U, 1U}) {
    const auto buffer = stream.take();
    ASSERT_TRUE(buffer);
    EXPECT_EQ(buffer->sequence, number);
    ASSERT_EQ(stream.requeue(buffer->index), 0);
  }
  ASSERT_EQ(injector_.frame({}, pixels), 0);
  const auto buffer = stream.take();
  ASSERT_TRUE(buffer);
  EXPECT_EQ(buffer->sequence, 5U);
}

TEST_F(Testcam, refuses_what_is_no_frame) {
  const auto pixels = noise(std::size_t{64} * 48 * 2, 1);
  EXPECT_EQ(injector_.frame({}, pixels), EPIPE) << "nobody streams";
  Stream stream(camera_);
  small(stream);
  EXPECT_EQ(injector_.frame({}, std::span(pixels).first(100)), EMSGSIZE);
  EXPECT_EQ(injector_.frame({}, noise(pixels.size() + 1, 1)), EMSGSIZE);
  EXPECT_EQ(stream.stop(), 0);
  EXPECT_EQ(injector_.frame({}, pixels), EPIPE);
  EXPECT_EQ(injector_.plug(), EBUSY);
}

TEST_F(Testcam, tells_the_injector_how_it_is_set) {
  Stream stream(camera_);
  ASSERT_EQ(stream.set_control(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL), 0);
  ASSERT_EQ(stream.set_control(V4L2_CID_EXPOSURE_ABSOLUTE, 83), 0);
  ASSERT_EQ(stream.set_control(V4L2_CID_GAIN, 250), 0);
  ASSERT_EQ(stream.set_control(TESTCAM_CID_TRIGGER_MODE, 2), 0);
  small(stream);
  const testcam_state state = injector_.state();
  EXPECT_EQ(state.auto_exposure, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(state.exposure, 83);
  EXPECT_EQ(state.gain, 250);
  EXPECT_EQ(state.trigger, 2);
  EXPECT_EQ(state.width, 64U);
  EXPECT_EQ(state.height, 48U);
  EXPECT_EQ(state.pixelformat, V4L2_PIX_FMT_Y16);
  EXPECT_EQ(state.streaming, 1U);
  EXPECT_EQ(state.queued, 4U);
}

/// Injects frames until the camera is lost. Returns the errno that reported it.
int inject_until_unplugged(const Injector& injector, const std::vector<std::byte>& pixels) {
  int error = 0;
  while (error == 0 || error == EPIPE) error = injector.frame({}, pixels);
  return error;
}

/// Streams until the camera is unplugged, `delay` ns after the start.
void stream_until_unplugged(const Injector& injector, Stream& stream, const std::vector<std::byte>& pixels,
                            std::int64_t delay) {
  std::thread maker([&] { EXPECT_EQ(inject_until_unplugged(injector, pixels), ENODEV); });
  std::thread cable([&] {
    sleep_until(now_ns() + delay);
    EXPECT_EQ(injector.unplug(), 0);
  });
  for (auto buffer = stream.take(); buffer && stream.requeue(buffer->index) == 0; buffer = stream.take()) {
  }
  cable.join();
  maker.join();
}

TEST_F(Testcam, survives_being_unplugged_while_it_streams) {
  for (int round = 0; round < 25; ++round) {
    {
      Stream stream(find_camera());
      ASSERT_TRUE(stream.ok()) << "round " << round << ": the camera has not come back";
      const auto pixels = small(stream);
      stream_until_unplugged(injector_, stream, pixels, std::int64_t{round} * 1'000'000);
      EXPECT_FALSE(stream.take());
      EXPECT_EQ(stream.error(), ENODEV);
      EXPECT_EQ(injector_.state().plugged, 0U);
      EXPECT_EQ(injector_.unplug(), ENODEV);
    }
    ASSERT_EQ(injector_.plug(), 0);
  }
}

/// As with a real camera, the number of a node is free only when the last program has closed it.
TEST_F(Testcam, comes_back_under_another_number_while_its_old_node_is_open) {
  const Stream old(camera_);
  ASSERT_TRUE(old.ok());
  ASSERT_EQ(injector_.unplug(), 0);
  ASSERT_EQ(injector_.plug(), 0);
  const std::string camera = find_camera();
  EXPECT_NE(camera, "");
  EXPECT_NE(camera, camera_);
  EXPECT_EQ(old.set_control(V4L2_CID_GAIN, 200), ENODEV);
}

}  // namespace
}  // namespace symrig::bench_vm::testcam_test
