// SPDX-License-Identifier: Apache-2.0
// A whole rig in virtual time whose camera is read through V4L2, from a driver in a script: its sensor is
// measured.
#include "assert_ok.hpp"
#include "symrig/board/link.hpp"
#include "symrig/board/ticks.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/camera/v4l2_camera.hpp"
#include "symrig/rig/sensor_frames.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "unit/camera/fake_video.hpp"

#include <memory>
#include <utility>

#include <gtest/gtest.h>

namespace symrig::video_rig_test {
namespace {

using namespace std::chrono_literals;
using test::FakeCamera;
using test::FakeFrame;
using test::FakeSystem;

constexpr Grid kGrid{64, 64};

/// On the board's trigger line, after the simulated shutter: hands each picture to the driver.
class Video final : public board_sim::Peripheral {
 public:
  /// fourcc, bits: the driver's only format; shift: unused bits below a sample.
  Video(std::uint32_t fourcc, int bits, int shift) : bits_(bits), shift_(shift) {
    driver_->formats = {{.fourcc = fourcc, .bits_a_pixel = 16, .sizes = {kGrid}}};
    driver_->set_now(0ns);
    system_.cameras["/dev/video0"] = driver_;
  }

  Result<RigParts> parts(const char* uri) {
    VirtualRigHooks hooks;
    hooks.camera = [this](Camera& simulated) { return open(simulated); };
    hooks.board = [this](board_sim::SimBoard& board) {
      if (!std::exchange(attached_, true)) board.attach(*this);
      return Board::connect(make_sim_link(board));
    };
    hooks.options = [](RigOptions& options) { options.ledger.guards = 4; };
    return virtual_rig_parts(uri, std::move(hooks));
  }

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard& board) override {
    const int line = board.line("camera_trigger");
    const bool high = line >= 0 && ((levels >> static_cast<unsigned>(line)) & 1U) != 0;
    const bool ended = std::exchange(high_, high) && !high;
    if (!ended || simulated_ == nullptr) return;
    auto frames = simulated_->take(1, 0ns);
    if (!frames || frames->empty()) return;
    deliver(frames->front(), TickRate{board.config().tick_hz}.nanoseconds({tick}));
  }
  std::uint64_t next_event() const override { return board_sim::kNever; }
  void on_event(std::uint64_t /*tick*/, board_sim::SimBoard& /*board*/) override {}

 private:
  Result<std::unique_ptr<Camera>> open(Camera& simulated) {
    simulated_ = &simulated;
    CameraSettings settings;
    settings.device = "/dev/video0";
    settings.bits = bits_;
    settings.justified = shift_ > 0 ? Justified::high : Justified::low;
    settings.timing = simulated.timing();  // and no noise: it is to be measured
    SYMRIG_TRY(auto camera, V4l2Camera::open(std::move(settings), system_));
    return std::unique_ptr<Camera>(std::move(camera));
  }

  void deliver(const CameraFrame& seen, Nanoseconds end) {
    FakeFrame frame;
    frame.sequence = number_++;
    frame.stamp = end;
    for (const std::uint16_t code : seen.raw) {
      const unsigned word = static_cast<unsigned>(code) >> (12 - bits_) << shift_;
      frame.bytes.push_back(static_cast<std::byte>(word & 0xFFU));
      frame.bytes.push_back(static_cast<std::byte>(word >> 8U));
    }
    driver_->set_now(end + 1ms);
    driver_->await_queued(1);
    ASSERT_TRUE(driver_->deliver(frame));
  }

  std::shared_ptr<FakeCamera> driver_ = std::make_shared<FakeCamera>();
  FakeSystem system_;
  Camera* simulated_ = nullptr;
  bool attached_ = false, high_ = false;
  int bits_, shift_;
  std::uint32_t number_ = 0;
};

struct Format {
  const char* name;
  std::uint32_t fourcc;
  int bits, shift;
};

class EveryFormat : public testing::TestWithParam<Format> {};

// 12 bits as they are, in the upper part of a word, and as a mosaic; and the upper 10 of them.
TEST_P(EveryFormat, tells_the_sensor) {
  const auto [name, fourcc, bits, shift] = GetParam();
  Video video(fourcc, bits, shift);
  auto parts = video.parts("sim:vgroove-textured?size=64x64");
  ASSERT_OK(parts);
  const auto rig = FrameTaker::open(*std::move(parts));
  ASSERT_OK(rig);
  EXPECT_EQ((*rig)->bits(), bits);
  SceneTransfer transfer((*rig)->camera_grid(), (*rig)->bits());
  const SceneSink sink{[&](const SceneLevel& level) { return transfer.begin(level); },
                       [&](auto first, auto second) { return transfer.add(first, second); }};
  ASSERT_OK(take_sensor_frames(**rig, sink));
  const auto found = transfer.finish();
  ASSERT_OK(found);
  ASSERT_TRUE(found->sensor);
  const Sensor& sensor = *found->sensor;
  EXPECT_LT(sensor.gain_sigma, 0.007);
  // Ten bits: the lower two are cut off. A dark noise of 0.3 codes does not smooth the steps, so the mean is
  // off by up to 0.05 codes, and the noise by half.
  const double pedestal = bits == 12 ? 64 : (64 - 1.5) / 4;
  EXPECT_NEAR(sensor.noise.pedestal(), pedestal, bits == 12 ? 0.05 : 0.1);
  EXPECT_NEAR(sensor.noise.full_well() / 20'000, 1, 5 * sensor.gain_sigma + 1.0 / sensor.noise.max_code());
  EXPECT_NEAR(sensor.noise.read_noise() / 6, 1, bits == 12 ? 5 * sensor.read_noise_sigma : 0.5) << name;
}
INSTANTIATE_TEST_SUITE_P(Formats, EveryFormat,
                         testing::Values(Format{"Y12", V4L2_PIX_FMT_Y12, 12, 0},
                                         Format{"Y16", V4L2_PIX_FMT_Y16, 12, 4},
                                         Format{"SRGGB12", V4L2_PIX_FMT_SRGGB12, 12, 0},
                                         Format{"Y10", V4L2_PIX_FMT_Y10, 10, 0}));

}  // namespace
}  // namespace symrig::video_rig_test
