// SPDX-License-Identifier: Apache-2.0
// A camera's driver that lies: its answers are a scripted driver's with bytes changed as the input says.
#include "compact_program.hpp"
#include "symrig/camera/v4l2_camera.hpp"
#include "targets.hpp"
#include "unit/camera/fake_video.hpp"

#include <chrono>
#include <memory>
#include <mutex>
#include <utility>

#include <linux/videodev2.h>
#include <sys/ioctl.h>

namespace symrig::fuzz {
namespace {

using namespace std::chrono_literals;
using camera::VideoNode;
using camera::Wake;

/// The part of an answer that holds no pointer of the caller's, from its begin.
std::size_t open_part(unsigned long request) {
  switch (request) {
    case VIDIOC_G_EXT_CTRLS:
    case VIDIOC_S_EXT_CTRLS:
      return 0;
    default:
      return _IOC_SIZE(request);
  }
}

class LyingNode final : public VideoNode {
 public:
  LyingNode(std::unique_ptr<VideoNode> honest, Input& input, std::mutex& mutex)
      : honest_(std::move(honest)), input_(input), mutex_(mutex) {}

  int control(unsigned long request, void* argument) override {
    const int reason = honest_->control(request, argument);
    const std::lock_guard lock(mutex_);
    const std::uint8_t lie = input_.byte();
    if (lie >= 250) return 1 + input_.byte() % 40;  // any errno
    const std::size_t size = open_part(request);
    for (int k = lie % 4; k > 0 && size > 0; --k) {
      const std::size_t at = input_.byte() % size;
      static_cast<std::uint8_t*>(argument)[at] = input_.byte();
    }
    return reason;
  }
  int map(std::size_t length, std::int64_t offset, std::span<const std::byte>& memory) override {
    return honest_->map(length, offset, memory);
  }
  void unmap(std::span<const std::byte> memory) override { honest_->unmap(memory); }
  Wake wait(Nanoseconds patience) override { return honest_->wait(patience); }
  void interrupt() override { honest_->interrupt(); }
  Nanoseconds now() override { return honest_->now(); }

 private:
  std::unique_ptr<VideoNode> honest_;
  Input& input_;
  std::mutex& mutex_;
};

class LyingSystem final : public camera::VideoSystem {
 public:
  explicit LyingSystem(Input& input) : input_(input) {
    fake->formats = {{V4L2_PIX_FMT_Y12, 16, {{6, 8}, {4, 4}}},
                     {V4L2_PIX_FMT_Y10P, 10, {{6, 8}}},
                     {V4L2_PIX_FMT_SRGGB8, 8, {{8, 8}}}};
    fake->controls = {
        {V4L2_CID_GAIN, "Gain", V4L2_CTRL_TYPE_INTEGER, 0, 255, 5, 0},
        {V4L2_CID_EXPOSURE_ABSOLUTE, "Mode", V4L2_CTRL_TYPE_MENU, 0, 2, 1, 0, 0, {"A", "", "B"}}};
    honest_.cameras["/dev/video0"] = fake;
  }
  std::vector<std::string> paths() override { return honest_.paths(); }
  std::string serial(const std::string& path) override { return honest_.serial(path); }
  int open(const std::string& path, std::unique_ptr<VideoNode>& node) override {
    std::unique_ptr<VideoNode> inner;
    const int reason = honest_.open(path, inner);
    if (reason == 0) node = std::make_unique<LyingNode>(std::move(inner), input_, mutex_);
    return reason;
  }

  std::shared_ptr<test::FakeCamera> fake = std::make_shared<test::FakeCamera>();

 private:
  Input& input_;
  std::mutex mutex_;
  test::FakeSystem honest_;
};

/// Results do not matter, only that there are some.
template <class T>
void expect_error_or_value(const Result<T>& result) {
  require(result.ok() || !result.error().what.empty(), "a failure says what failed");
}

CameraSettings settings_from(std::uint8_t choice) {
  CameraSettings settings;
  settings.device = "/dev/video0";
  settings.buffers = 2;
  if ((choice & 1U) != 0) settings.format = "Y10P";
  if ((choice & 2U) != 0) settings.region = {0, 0, {4, 4}, 2};
  if ((choice & 4U) != 0) settings.controls = {{"gain", "5"}, {"mode", "B"}};
  return settings;
}

/// Frames of the size that was promised, whatever the driver says.
void stream(V4l2Camera& camera, test::FakeCamera& fake) {
  const std::size_t pixels = camera.grid().size();
  for (std::uint32_t k = 0; k < 6; ++k) {
    test::FakeFrame frame;
    frame.sequence = k;
    frame.stamp = 100s + (k + 1) * 1ms;
    fake.deliver(frame);
    const auto frames = camera.take(1, 1ms);
    if (!frames) break;
    for (const CameraFrame& taken : *frames)
      require(taken.raw.size() == pixels, "a frame has its grid's size");
  }
  expect_error_or_value(camera.set_control("gain", "10"));
  require(!camera.describe().empty(), "a camera has a name");
}

}  // namespace

void fuzz_camera(const std::uint8_t* data, std::size_t size) {
  Input input({data, size});
  const CameraSettings settings = settings_from(input.byte());
  LyingSystem system(input);
  expect_error_or_value(look_at_camera(system, "/dev/video0"));
  auto camera = V4l2Camera::open(settings, system);
  expect_error_or_value(camera);
  if (!camera) return;
  stream(**camera, *system.fake);
  expect_error_or_value((*camera)->reopen());
}

}  // namespace symrig::fuzz
