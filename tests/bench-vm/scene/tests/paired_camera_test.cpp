// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/paired_camera.hpp"

#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::paired_camera_test {
namespace {

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

}  // namespace
}  // namespace symrig::bench_vm::paired_camera_test
