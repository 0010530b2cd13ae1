// SPDX-License-Identifier: Apache-2.0
// The frames for a sensor's measurement, from whole rigs in virtual time whose sensor is known.
// A whole rig in virtual time whose camera is read through V4L2, from a driver in a script: its sensor is
// measured.

#include "assert_ok.hpp"
#include "faulty_devices.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/link.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/camera/v4l2_camera.hpp"
#include "symrig/rig/frame_taker.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "unit/camera/fake_video.hpp"

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::sensor_frames_test {

namespace {

using namespace std::chrono_literals;

/// A measurement, with what it took.
struct Measured {
  SceneSensor found;
  std::vector<SceneLevel> levels;
  std::int64_t frames = 0;
};

Result<Measured> measure(RigParts parts, const SensorFramesOptions& options = {}) {
  SYMRIG_TRY(const auto rig, FrameTaker::open(std::move(parts)));
  SceneTransfer transfer(rig->camera_grid(), rig->bits());
  Measured measured;
  const SceneSink sink{[&](const SceneLevel& level) {
                         measured.levels.push_back(level);
                         return transfer.begin(level);
                       },
                       [&](auto first, auto second) { return transfer.add(first, second); }};
  SYMRIG_CHECK(take_sensor_frames(*rig, sink, options));
  SYMRIG_TRY(measured.found, transfer.finish());
  measured.frames = rig->frames();
  return measured;
}

Result<Measured> measure(const std::string& uri, VirtualRigHooks hooks = {}) {
  SYMRIG_TRY(RigParts parts, virtual_rig_parts(uri, std::move(hooks)));
  return measure(std::move(parts));
}

/// The sensor of every simulated rig (docs/command-line.md).
NoiseModel truth() {
  return NoiseModel::from_electrons({.full_well = 20'000, .read_noise = 6, .bits = 12, .pedestal = 64});
}

struct Errors {
  double gain = 0, read = 0;  ///< in stated sigmas
};

Errors expect_the_sensor(const SceneSensor& found) {
  EXPECT_TRUE(found.sensor);
  if (!found.sensor) return {};
  const Sensor& sensor = *found.sensor;
  const NoiseModel& noise = sensor.noise;
  const Errors errors{(noise.gain() / truth().gain() - 1) / sensor.gain_sigma,
                      (noise.read_noise() / truth().read_noise() - 1) / sensor.read_noise_sigma};
  EXPECT_LT(std::abs(errors.gain), 5);
  EXPECT_LT(std::abs(errors.read), 5);
  // Gain and read noise, 5 sigmas: 3 % and 5 %, as frames_needed() was asked for.
  EXPECT_LT(sensor.gain_sigma, 0.006);
  EXPECT_LT(sensor.read_noise_sigma, 0.01);
  EXPECT_EQ(noise.bits(), 12);
  // Six dark frames or more: the mean of 6 · 4,096 samples of 1.24 DN; the projector's black level adds
  // 0.1 e- in 20 us, which the dark levels' line removes to a tenth.
  EXPECT_NEAR(noise.pedestal(), truth().pedestal(), 5 * 1.24 / std::sqrt(6 * 4096.0) + 0.01);
  EXPECT_NEAR(noise.full_well() / 20'000, 1, 5 * sensor.gain_sigma + 1.0 / 4095);
  EXPECT_TRUE(found.linearity.linear()) << found.linearity.worst;
  return errors;
}

class EveryScene : public testing::TestWithParam<const char*> {};

// χ² of 8: below 0.85 and above 26.1 once in 1,000 each.
TEST_P(EveryScene, tells_the_sensor) {
  constexpr int kSeeds = 8;
  double gain = 0, read = 0;
  std::int64_t frames = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const auto measured = measure(fmt::format("sim:{}&noise_seed={}", GetParam(), seed));
    ASSERT_OK(measured);
    const Errors errors = expect_the_sensor(measured->found);
    gain += errors.gain * errors.gain;
    read += errors.read * errors.read;
    frames = measured->frames;
  }
  EXPECT_GT(gain, 0.85);
  EXPECT_LT(gain, 26.1);
  EXPECT_GT(read, 0.85);
  EXPECT_LT(read, 26.1);
  std::printf("%s: %d frames; chi2 of 8: gain %.1f, read noise %.1f\n", GetParam(), static_cast<int>(frames),
              gain, read);
}
INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene,
                         testing::Values("plane?size=64x64", "vgroove-textured?size=64x64",
                                         "gummy?size=64x64", "occluder?size=64x64&light=0.01"));

TEST(SensorFrames, a_screen_and_bit_planes_do_as_well) {
  VirtualRigHooks screen;
  screen.pacing = Pacing::host;
  const auto on_screen = measure("sim:vgroove-textured?size=64x64", std::move(screen));
  ASSERT_OK(on_screen);
  expect_the_sensor(on_screen->found);
  const auto in_planes = measure("sim:vgroove-textured?size=64x64&profile=dlpc350");
  ASSERT_OK(in_planes);
  expect_the_sensor(in_planes->found);
}

TEST(SensorFrames, cover_the_range_from_dark_to_saturation) {
  const auto measured = measure("sim:vgroove-textured?size=64x64");
  ASSERT_OK(measured);
  EXPECT_TRUE(measured->found.clipping_seen);
  EXPECT_EQ(measured->found.dark_levels, 3);
  EXPECT_EQ(measured->found.lit_levels, 8);
  EXPECT_FALSE(measured->levels.front().lit);
  EXPECT_LT(measured->levels.front().exposure, 25us);
  // The light's share in the levels between: each is 1.5 times the one before or more.
  for (std::size_t k = 5; k < 9; ++k)
    EXPECT_GT(measured->levels[k].exposure, 1.25 * measured->levels[k - 1].exposure) << k;
  EXPECT_NEAR(seconds(measured->levels.back().exposure) / seconds(measured->levels[3].exposure), 1, 1e-3);
}

// A projector whose light is whole after a refresh only: 16.7 ms, with a grey filter that allows it.
TEST(SensorFrames, keep_to_whole_periods_of_the_light) {
  VirtualRigHooks hooks;
  hooks.options = [](RigOptions& options) { options.setup.projector.light_period = 10ms; };
  const auto measured = measure("sim:plane?size=64x64&light=0.01", std::move(hooks));
  ASSERT_OK(measured);
  ASSERT_TRUE(measured->found.sensor);
  EXPECT_NEAR(measured->found.sensor->noise.gain() / truth().gain(), 1,
              5 * measured->found.sensor->gain_sigma);
  for (const SceneLevel& level : measured->levels)
    EXPECT_NEAR(std::remainder(seconds(level.exposure), 0.01), 0, 2e-6);
}

/// Gives other frames than the camera behind it.
class ChangedFrames : public test::OtherCamera {
 public:
  using OtherCamera::OtherCamera;
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override {
    SYMRIG_TRY(auto frames, OtherCamera::take(count, patience));
    for (CameraFrame& frame : frames) change(frame);
    return frames;
  }

 private:
  virtual void change(CameraFrame& frame) = 0;
};

/// Its own timer ends each exposure: the picture is the same, however long the trigger is.
class OwnTimer final : public ChangedFrames {
 public:
  using ChangedFrames::ChangedFrames;

 private:
  void change(CameraFrame& frame) override {
    double mean = 0;
    for (const std::uint16_t code : frame.raw) mean += code / static_cast<double>(frame.raw.size());
    if (mean < 66) return;  // the projector is black
    for (std::uint16_t& code : frame.raw) code = static_cast<std::uint16_t>(1000 + 50 * random_.uniform());
  }
  Random random_{3};
};

/// 8 bits with the gamma of a webcam.
class Gamma final : public ChangedFrames {
 public:
  using ChangedFrames::ChangedFrames;
  const NoiseModel& noise() const override { return noise_; }

 private:
  void change(CameraFrame& frame) override {
    for (std::uint16_t& code : frame.raw) {
      const double light = std::max(0.0, (code - 55.0) / (4095 - 55));
      code = static_cast<std::uint16_t>(std::lround(255 * std::pow(light, 1 / 2.2)));
    }
  }
  NoiseModel noise_ = NoiseModel::from_electrons({.bits = 8, .pedestal = 0});
};

class SlowShutter final : public test::OtherCamera {
 public:
  using OtherCamera::OtherCamera;
  CameraTiming timing() const override {
    CameraTiming timing = OtherCamera::timing();
    timing.min_exposure = 20ms;
    return timing;
  }
};

class QuickShutter final : public test::OtherCamera {
 public:
  using OtherCamera::OtherCamera;
  CameraTiming timing() const override {
    CameraTiming timing = OtherCamera::timing();
    timing.max_exposure = 100ms;
    return timing;
  }
};

template <class Kind>
VirtualRigHooks with_camera() {
  VirtualRigHooks hooks;
  hooks.camera = [](Camera& inner) -> Result<std::unique_ptr<Camera>> {
    return std::unique_ptr<Camera>(std::make_unique<Kind>(inner));
  };
  return hooks;
}

void expect_refusal(const Result<Measured>& measured, ErrorCode code, const std::string& what) {
  ASSERT_FALSE(measured.ok()) << what;
  EXPECT_EQ(measured.error().code, code) << measured.error().line();
  EXPECT_NE(measured.error().what.find(what), std::string::npos) << measured.error().line();
  EXPECT_FALSE(measured.error().hint.empty());
}

TEST(SensorFrames, hostile_rigs_are_refused_with_a_reason) {
  expect_refusal(measure("sim:plane?size=64x64", with_camera<OwnTimer>()), ErrorCode::device_refused,
                 "does not follow its exposure: 4 times as long gives 1.00 times the light");
  expect_refusal(measure("sim:plane?size=64x64", with_camera<SlowShutter>()), ErrorCode::limit,
                 "saturates the camera at its shortest exposure, 20 ms");
  expect_refusal(measure("sim:plane?size=64x64&light=0.001", with_camera<QuickShutter>()), ErrorCode::limit,
                 "too dark: at the longest exposure, 0.1 s");
  expect_refusal(measure("sim:plane?size=64x64&noise=off"), ErrorCode::bad_argument, "no noise");
  expect_refusal(measure("sim:plane?size=64x64&channels=3"), ErrorCode::bad_argument,
                 "codes for 4096 pixels");
}

// 0.5 over 1,000 patterns; about a hundred are shown.
TEST(SensorFrames, a_lamp_that_drifts_is_refused) {
  expect_refusal(measure("sim:plane?size=64x64&drift=0.5"), ErrorCode::limit, "the light changed by ");
}

TEST(SensorFrames, a_camera_with_a_gamma_is_not_linear) {
  const auto measured = measure("sim:vgroove-textured?size=64x64", with_camera<Gamma>());
  ASSERT_OK(measured);
  EXPECT_FALSE(measured->found.linearity.linear(0.05)) << measured->found.linearity.worst;
  EXPECT_TRUE(measured->found.response);
}

// A camera that loses, copies and delays frames: the ledger takes only those that it is certain of.
TEST(SensorFrames, a_camera_that_loses_frames_gives_the_same_sensor) {
  VirtualRigHooks hooks;
  const auto mischief = std::make_shared<test::CameraMischief>();
  mischief->lost = mischief->copied = mischief->damaged = 0.02;
  hooks.camera = [mischief](Camera& inner) { return test::FaultyCamera::open(inner, mischief); };
  hooks.options = [](RigOptions& options) {
    options.ledger.guards = 4;
    options.retakes = 20;
  };
  const auto measured = measure("sim:plane?size=64x64", std::move(hooks));
  ASSERT_OK(measured);
  expect_the_sensor(measured->found);
}

TEST(SensorFrames, can_be_stopped) {
  auto parts = virtual_rig_parts("sim:plane?size=64x64");
  ASSERT_OK(parts);
  int calls = 0;
  std::int64_t expected = 0;
  SensorFramesOptions options;
  options.progress = [&](const ProgressEvent& event) {
    expected = event.expected;
    return ++calls < 20;
  };
  expect_refusal(measure(*std::move(parts), options), ErrorCode::interrupted, "stopped after ");
  EXPECT_GT(expected, 30);
}

}  // namespace

}  // namespace symrig::sensor_frames_test

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
