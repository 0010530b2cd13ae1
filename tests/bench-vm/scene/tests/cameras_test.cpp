// SPDX-License-Identifier: Apache-2.0
#include "assert_ok.hpp"
#include "bench-vm/scene/controller_on_usb.hpp"
#include "bench-vm/scene/scene_camera.hpp"
#include "bench-vm/scene/stage.hpp"
#include "symrig/base/time.hpp"
#include "usbip/usbip_server.hpp"

#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::cameras_test {
namespace {

TEST(CameraPicture, puts_the_grid_where_it_is_asked_for) {
  const CameraPicture picture{{3, 4}, {2, 2}, 1, 2, 0x0140};
  const std::uint16_t codes[] = {0x0fff, 0x0001, 0x0234, 0x0000};
  const std::vector<std::uint8_t> expected{
      0x40, 1, 0x40, 1, 0x40, 1,    0x40, 1,  //
      0x40, 1, 0x40, 1, 0xff, 0x0f, 0x01, 0,  //
      0x40, 1, 0x40, 1, 0x34, 0x02, 0x00, 0,
  };
  EXPECT_EQ(picture.bytes(codes), expected);
}

TEST(CameraPicture, refuses_a_grid_that_does_not_fit) {
  EXPECT_TRUE((CameraPicture{{3, 4}, {3, 4}, 0, 0, 0}.check()));
  for (const CameraPicture& picture :
       {CameraPicture{{3, 4}, {3, 4}, 1, 0, 0}, CameraPicture{{3, 4}, {3, 5}, 0, 0, 0},
        CameraPicture{{3, 4}, {1, 1}, -1, 0, 0}, CameraPicture{{3, 4}, {1, 1}, 0, 4, 0}}) {
    const auto checked = picture.check();
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().code, ErrorCode::size_mismatch);
  }
}

using namespace std::chrono_literals;
using Frames = std::vector<DeliveredFrame>;

/// Keeps what it gets.
class Keeper final : public SceneCamera {
 public:
  Keeper(Settings settings, CameraPort::Taken taken, Frames& frames)
      : settings_(settings), taken_(taken), frames_(frames) {}

  Result<Settings> settings() const override { return settings_; }
  Result<CameraPort::Taken> deliver(const DeliveredFrame& frame) override {
    frames_.push_back(frame);
    return taken_;
  }
  Result<void> plug(bool /*in*/) override { return {}; }

 private:
  Settings settings_;
  CameraPort::Taken taken_;
  Frames& frames_;
};

/// Two cameras of 2x2 pixels.
struct Two {
  Frames left, right;
  std::unique_ptr<SceneCamera> both;

  Two(SceneCamera::Settings of_left, SceneCamera::Settings of_right, CameraPort::Taken by_right,
      std::optional<std::uint64_t> lost)
      : both(pair_cameras(std::make_unique<Keeper>(of_left, CameraPort::Taken::yes, left),
                          std::make_unique<Keeper>(of_right, by_right, right), {2, 2}, lost)) {}

  CameraPort::Taken deliver(std::uint64_t number) const {
    DeliveredFrame frame;
    frame.frame = number;
    frame.stamp = 100ns;
    frame.open = 30ns;
    frame.codes = std::make_shared<const std::vector<std::uint16_t>>(
        std::vector<std::uint16_t>{1, 2, 3, 4, 5, 6, 7, 8});
    return both->deliver(frame).value();
  }
};

TEST(PairedCamera, gives_each_camera_its_columns_and_its_stamp) {
  const Two two({true, true}, {true, false}, CameraPort::Taken::yes, {});
  EXPECT_EQ(two.deliver(0), CameraPort::Taken::yes);
  EXPECT_EQ(*two.left.at(0).codes, (std::vector<std::uint16_t>{1, 2, 5, 6}));
  EXPECT_EQ(*two.right.at(0).codes, (std::vector<std::uint16_t>{3, 4, 7, 8}));
  EXPECT_EQ(two.left[0].stamp, 100ns);   // the begin of the exposure
  EXPECT_EQ(two.right[0].stamp, 130ns);  // its end
}

TEST(PairedCamera, loses_a_frame_of_the_right_camera_only) {
  const Two two({true, false}, {true, false}, CameraPort::Taken::yes, 1);
  for (std::uint64_t number = 0; number < 3; ++number) two.deliver(number);
  EXPECT_EQ(two.left.size(), 3U);
  ASSERT_EQ(two.right.size(), 2U);
  EXPECT_EQ(two.right[0].skip, 0U);
  EXPECT_EQ(two.right[1].frame, 2U);
  EXPECT_EQ(two.right[1].skip, 1U);
}

TEST(PairedCamera, exposes_when_both_do) {
  EXPECT_FALSE(
      Two({true, false}, {false, false}, CameraPort::Taken::yes, {}).both->settings()->follows_pulse);
  EXPECT_TRUE(Two({true, false}, {true, false}, CameraPort::Taken::yes, {}).both->settings()->follows_pulse);
  EXPECT_EQ(Two({true, false}, {true, false}, CameraPort::Taken::unplugged, {}).deliver(0),
            CameraPort::Taken::unplugged);
}

TEST(Stage, hands_exposures_on_in_order_once_they_are_ripe) {
  Stage stage;
  const Nanoseconds now = steady_now();
  stage.exposed({0, {now - 3s, 0ns}, {now - 2s, 0ns}});
  stage.exposed({1, {now - 1s, 0ns}, {now + 1h, 0ns}});
  ASSERT_TRUE(stage.next_exposure(1s, now));
  EXPECT_EQ(stage.next_exposure(1s, now), std::nullopt);
}

// Called from other threads, like the watchers: nothing is lost, and stop() wakes waiting threads.
TEST(Stage, is_told_by_other_threads) {
  Stage stage;
  const Nanoseconds now = steady_now();
  std::thread watcher([&stage, now] {
    for (std::uint64_t i = 0; i < 500; ++i) {
      stage.show(now + Nanoseconds{static_cast<std::int64_t>(i)},
                 std::make_shared<const Image<float>>(Grid{1, 1}, 1, static_cast<float>(i)));
      stage.exposed({i, {now - 2s, 0ns}, {now - 1s, 0ns}});
    }
    stage.stop(Error{ErrorCode::fault, "first", ""});
    stage.stop(Error{ErrorCode::io, "second", ""});
  });
  std::uint64_t next = 0;
  while (next < 500) {
    const auto exposure = stage.next_exposure(0ns, now + 1h);
    if (!exposure) continue;
    EXPECT_EQ(exposure->frame, next);
    ++next;
  }
  watcher.join();
  EXPECT_TRUE(stage.stopped());
  ASSERT_TRUE(stage.failure());
  EXPECT_EQ(stage.failure()->what, "first");
  EXPECT_EQ(stage.newest().number, 499U);
  EXPECT_EQ(stage.next_exposure(0ns, now + 1h), std::nullopt);  // does not wait, because it was stopped
}

using Kind = ControllerFault::Kind;

// What goes wrong with the controller of bit planes, refresh by refresh. No host is attached, so a program
// before symrig has set the sequence: bench.plane_capture meets the drivers.

TEST(ControllerFaults, are_read_from_their_words) {
  const auto reset = parse_controller_fault("reset@40");
  ASSERT_OK(reset);
  EXPECT_EQ(reset->kind, Kind::reset);
  EXPECT_EQ(reset->after, 40U);
  EXPECT_EQ(parse_controller_fault("table@0")->kind, Kind::table);
  EXPECT_EQ(parse_controller_fault("stall@1")->kind, Kind::stall);
  EXPECT_EQ(parse_controller_fault("hang@1")->kind, Kind::hang);
  for (const std::string text : {"", "reset", "reset@", "reset@-1", "reset@4x", "melt@4", "@4"}) {
    const auto bad = parse_controller_fault(text);
    ASSERT_FALSE(bad.ok()) << text;
    EXPECT_EQ(bad.error().code, ErrorCode::bad_argument);
  }
}

TEST(SceneController, is_of_a_known_kind_and_has_a_port_of_its_own) {
  EXPECT_EQ(SceneController::serve("dlpc410", {}, 0).error().code, ErrorCode::bad_argument);
  const test::UsbIpServer taken(nullptr, 0);
  EXPECT_EQ(SceneController::serve("dlpc900", {}, taken.port()).error().code, ErrorCode::io);
}

// Faults come in their order, counted from the last time that the power came on.
TEST(SceneController, faults_come_after_their_exposures) {
  const auto controller =
      SceneController::serve("dlpc350", {{Kind::stall, 2}, {Kind::hang, 5}, {Kind::reset, 3}}, 0);
  ASSERT_OK(controller);
  const auto faults_after = [&](std::uint64_t exposures) {
    (*controller)->next_refresh(exposures);
    return (*controller)->faults();
  };
  EXPECT_EQ(faults_after(1), 0U);
  EXPECT_EQ(faults_after(2), 1U);
  EXPECT_EQ(faults_after(4), 1U);
  (*controller)->cycle_power(4);
  EXPECT_EQ(faults_after(8), 1U);
  EXPECT_EQ(faults_after(9), 2U);
  EXPECT_EQ(faults_after(20), 2U);  // it hangs
  (*controller)->cycle_power(20);
  EXPECT_EQ(faults_after(22), 2U);
  EXPECT_EQ(faults_after(23), 3U);
}

}  // namespace
}  // namespace symrig::bench_vm::cameras_test
