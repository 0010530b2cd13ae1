// SPDX-License-Identifier: Apache-2.0
// V4l2Camera with the test camera, whose frames, losses and stamps are known. Every frame arrives unchanged
// or is counted as lost. SYMRIG_CAMERA_FRAMES: number of frames in the long stream.
#include "assert_ok.hpp"
#include "bench-vm/selftest/guest.hpp"
#include "bench-vm/selftest/testcam_client.hpp"
#include "symrig/camera/v4l2_camera.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::testcam_stream_test {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kLong = 60s;  // time-out for a broken test; has no effect otherwise

constexpr std::size_t kSmallPixels = 3072;  // of pictures of 48 x 64

/// Pixels that identify their frame. Each pixel does it in its own way.
std::uint16_t pixel(std::uint32_t frame, std::size_t k) {
  return static_cast<std::uint16_t>(std::size_t{frame} * 40'503U + k * 31U);
}

std::vector<std::uint16_t> codes(std::uint32_t frame, std::size_t pixels) {
  std::vector<std::uint16_t> all(pixels);
  for (std::size_t k = 0; k < pixels; ++k) all[k] = pixel(frame, k);
  return all;
}

std::vector<std::byte> picture(std::uint32_t frame, std::size_t pixels) {
  const auto words = codes(frame, pixels);
  std::vector<std::byte> bytes(2 * pixels);
  std::memcpy(bytes.data(), words.data(), bytes.size());
  return bytes;
}

bool is_whole(const CameraFrame& frame, std::uint32_t id) {
  return frame.raw == codes(id, frame.raw.size());
}

/// The frame, of the first sixteen, that could have this first pixel.
std::uint32_t id_of(const CameraFrame& frame) {
  std::uint32_t id = 0;
  while (id < 16 && frame.raw[0] != pixel(id, 0)) ++id;
  return id;
}

CameraSettings settings_for(Grid size) {
  CameraSettings settings;
  settings.device = place("BENCH_CAMERA");
  settings.format = "Y16";
  settings.size = size;
  settings.controls = {
      {"auto_exposure", "Manual Mode"}, {"exposure_time_absolute", "83"}, {"trigger_mode", "External Level"}};
  return settings;
}

int wanted_frames(int otherwise) {
  const char* const text = std::getenv("SYMRIG_CAMERA_FRAMES");
  return text == nullptr ? otherwise : static_cast<int>(std::strtol(text, nullptr, 10));
}

class TestcamStream : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(injector_.state().plugged, 1U); }
  void TearDown() override { injector_.plug(); }

  /// Sends a frame as soon as possible.
  void send(std::uint32_t id, std::size_t pixels, testcam_frame head = {}) {
    ASSERT_EQ(injector_.frame(head, picture(id, pixels)), 0) << id;
  }

  Injector injector_;
};

TEST_F(TestcamStream, pixels_stamps_and_numbers_arrive_as_sent) {
  auto camera = V4l2Camera::open(settings_for({48, 64}));
  ASSERT_OK(camera);
  std::vector<std::int64_t> stamps;
  for (std::uint32_t id = 0; id < 20; ++id) {
    stamps.push_back(now_ns() / 1000 * 1000);
    send(id, kSmallPixels,
         {static_cast<std::uint64_t>(stamps.back()), id == 10 ? 3U : 0U, id == 15 ? TESTCAM_DAMAGED : 0U});
    const auto frames = (*camera)->take(1, kLong);
    ASSERT_OK(frames);
    ASSERT_EQ(frames->size(), 1U);
    const CameraFrame& frame = frames->front();
    EXPECT_EQ(frame.sequence, id < 10 ? id : id + 3);
    EXPECT_EQ(frame.stamp.since.count(), stamps.back());
    EXPECT_EQ(frame.stamp_of,
              injector_.state().stamp_is_start == 1 ? StampOf::exposure_begin : StampOf::exposure_end);
    EXPECT_EQ(frame.damaged, id == 15);
    EXPECT_TRUE(frame.damaged || is_whole(frame, id));
  }
  EXPECT_EQ((*camera)->report().missing, 3U);
  EXPECT_EQ(injector_.state().exposure, 83);
  EXPECT_EQ(injector_.state().trigger, 2);
}

TEST_F(TestcamStream, every_format_of_the_camera_is_read) {
  const auto info = look_at_camera(place("BENCH_CAMERA"));
  ASSERT_OK(info);
  int formats = 0;
  for (const FormatOffer& offer : info->formats) {
    ASSERT_NE(offer.format, nullptr) << offer.name();
    auto settings = settings_for({48, 64});
    settings.format = offer.name();
    auto camera = V4l2Camera::open(settings);
    ASSERT_OK(camera);
    const bool words = offer.format->packing == Packing::words;
    std::vector<std::byte> bytes(injector_.state().sizeimage, std::byte{0x01});
    ASSERT_EQ(injector_.frame({}, bytes), 0);
    const auto frames = (*camera)->take(1, kLong);
    ASSERT_OK(frames);
    ASSERT_EQ(frames->size(), 1U) << offer.name();
    EXPECT_EQ(frames->front().raw, std::vector<std::uint16_t>(kSmallPixels, words ? 0x101 : 1))
        << offer.name();
    ++formats;
  }
  EXPECT_GE(formats, 9);
}

TEST_F(TestcamStream, sizes_that_the_camera_makes_something_else_of_are_refused) {
  auto settings = settings_for({4801, 64});
  const auto camera = V4l2Camera::open(settings);
  ASSERT_FALSE(camera.ok());
  EXPECT_EQ(camera.error().code, ErrorCode::device_refused);
  EXPECT_NE(camera.error().line().find("but the driver set"), std::string::npos) << camera.error().line();
}

TEST_F(TestcamStream, a_camera_that_somebody_streams_from_is_said_to_be_held) {
  auto first = V4l2Camera::open(settings_for({48, 64}));
  ASSERT_OK(first);
  const auto second = V4l2Camera::open(settings_for({48, 64}));
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().line().find("another program uses"), std::string::npos) << second.error().line();
}

/// Sends eight pictures in turn, some lost or damaged, as fast as the kernel accepts them.
class Source {
 public:
  Source(const Injector& injector, std::size_t pixels) : injector_(injector) {
    for (std::uint32_t k = 0; k < kPictures; ++k) pictures_.push_back(picture(k, pixels));
  }

  void send(int frames) {
    for (int k = 0; k < frames; ++k) {
      testcam_frame head{};
      if (random_() % 50 == 0) head.skip = 1 + static_cast<std::uint32_t>(random_() % 3);
      if (random_() % 50 == 0) head.flags = TESTCAM_DAMAGED;
      send_one(head);
    }
  }

  void send_one(const testcam_frame& head) {
    const auto id = static_cast<std::uint32_t>(random_() % kPictures);
    if (injector_.frame(head, pictures_[id]) != 0) ++refused;
    skipped += head.skip;
    sent[next_ += head.skip] = {id, (head.flags & TESTCAM_DAMAGED) != 0};
    ++next_;
  }

  struct Sent {
    std::uint32_t id;
    bool damaged;
  };
  static constexpr std::uint32_t kPictures = 8;
  std::map<std::uint64_t, Sent> sent;  // by sequence number
  std::uint64_t skipped = 0, refused = 0;

 private:
  const Injector& injector_;
  std::mt19937 random_{2006};
  std::vector<std::vector<std::byte>> pictures_;
  std::uint64_t next_ = 0;
};

/// A received frame.
struct Arrived {
  std::uint64_t sequence;
  std::uint32_t id;  ///< its picture; Source::kPictures: unknown picture
  bool damaged;
};

/// Compares every pixel with the known pictures.
Arrived identify(const CameraFrame& frame, const std::vector<std::vector<std::uint16_t>>& pictures) {
  const auto same = std::find(pictures.begin(), pictures.end(), frame.raw);
  return {frame.sequence, static_cast<std::uint32_t>(same - pictures.begin()), frame.damaged};
}

// The target: 1280 × 1024 Y16 as fast as the guest can, and no frame lost without notice. Every number that
// the camera counted is a frame with correct pixels, or is missing for a counted reason.
TEST_F(TestcamStream, a_megapixel_stream_loses_nothing_in_silence) {
  constexpr Grid kSize{1024, 1280};
  auto opened = V4l2Camera::open(settings_for(kSize));
  ASSERT_OK(opened);
  V4l2Camera& camera = **opened;
  Source source(injector_, static_cast<std::size_t>(kSize.size()));
  std::vector<std::vector<std::uint16_t>> pictures;
  for (std::uint32_t id = 0; id < Source::kPictures; ++id)
    pictures.push_back(codes(id, static_cast<std::size_t>(kSize.size())));
  std::atomic<bool> sent_all = false;
  const std::int64_t begin = now_ns();
  std::thread sender([&] {
    source.send(wanted_frames(300));
    // The last frame needs a buffer, so that no lost frame comes after it.
    while (injector_.state().queued == 0) std::this_thread::sleep_for(1ms);
    source.send_one({});
    sent_all = true;
  });
  std::vector<Arrived> arrived;
  while (!sent_all || arrived.empty() || arrived.back().sequence != source.sent.rbegin()->first) {
    auto frames = camera.take(1, 100ms);
    if (!frames) break;
    for (const CameraFrame& frame : *frames) arrived.push_back(identify(frame, pictures));
  }
  sender.join();
  const double spent = 1e-9 * static_cast<double>(now_ns() - begin);

  const StreamReport report = camera.report();
  const std::uint64_t lost = injector_.state().lost;
  EXPECT_EQ(source.refused, 0U);
  EXPECT_EQ(report.delivered, arrived.size());
  EXPECT_EQ(source.sent.size(), report.delivered + report.overflowed + lost);
  EXPECT_EQ(report.missing, source.skipped + lost);
  for (const Arrived& frame : arrived) {
    const auto truth = source.sent.find(frame.sequence);
    ASSERT_NE(truth, source.sent.end()) << frame.sequence;
    EXPECT_EQ(frame.damaged, truth->second.damaged) << frame.sequence;
    EXPECT_EQ(frame.id, truth->second.id) << frame.sequence;
  }
  std::printf(
      "sent %zu frames of %d x %d and left out %llu numbers; %.1f frames/s; in the camera %llu found no "
      "buffer; %s\n",
      source.sent.size(), kSize.rows, kSize.cols, static_cast<unsigned long long>(source.skipped),
      static_cast<double>(source.sent.size()) / spent, static_cast<unsigned long long>(lost),
      report.to_string().c_str());
}

// Unplugged during a stream, many times: it is reported each time, and the camera comes back with its
// settings.
TEST_F(TestcamStream, unplugged_while_streaming_twenty_times) {
  constexpr Grid kSize{240, 320};
  constexpr auto kPixels = static_cast<std::size_t>(kSize.size());
  auto opened = V4l2Camera::open(settings_for(kSize));
  ASSERT_OK(opened);
  V4l2Camera& camera = **opened;
  std::mt19937 random(7);
  std::uint64_t highest = 0, received = 0;
  for (int round = 0; round < 20; ++round) {
    const auto pulled = static_cast<std::uint32_t>(1 + random() % 15);
    std::thread hand([&, pulled] {
      for (std::uint32_t id = 0; id < pulled; ++id) injector_.frame({}, picture(id, kPixels));
      injector_.unplug();
    });
    auto frames = camera.take(100, kLong);
    for (; frames; frames = camera.take(100, kLong))
      for (const CameraFrame& frame : *frames) {
        EXPECT_TRUE(received == 0 || frame.sequence > highest) << round;
        highest = std::max(highest, frame.sequence);
        ++received;
        EXPECT_TRUE(is_whole(frame, id_of(frame))) << round;
      }
    hand.join();
    EXPECT_EQ(frames.error().code, ErrorCode::device_lost) << frames.error().line();
    EXPECT_NE(frames.error().line().find("(symrig test camera) is lost"), std::string::npos)
        << frames.error().line();
    const auto gone = camera.reopen();
    ASSERT_FALSE(gone.ok());
    EXPECT_EQ(gone.error().code, ErrorCode::device_lost);
    ASSERT_EQ(injector_.plug(), 0);
    const std::int64_t until = now_ns() + kLong.count();
    auto back = camera.reopen();
    while (!back && now_ns() < until) {  // its node appears a moment later
      std::this_thread::sleep_for(10ms);
      back = camera.reopen();
    }
    ASSERT_OK(back);
    EXPECT_EQ(injector_.state().exposure, 83);
  }
  EXPECT_GT(received, 0U);
  std::printf("20 times unplugged: %s\n", camera.report().to_string().c_str());
}

}  // namespace
}  // namespace symrig::bench_vm::testcam_stream_test
