// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"

#include <cstddef>
#include <functional>

#include <gtest/gtest.h>

/// The laws that every Camera keeps. Whoever writes a driver runs expect_camera_laws on its camera:
///
///   expect_camera_laws(*camera, [&](std::size_t count) { ...let the camera expose `count` times... });
namespace symrig {

/// What a camera says of itself before it has taken a frame.
inline void expect_camera_facts(const Camera& camera) {
  EXPECT_TRUE(camera.grid().valid());
  EXPECT_GE(camera.channels(), 1);
  EXPECT_TRUE(camera.noise().valid()) << camera.noise().to_string();
  const CameraTiming timing = camera.timing();
  EXPECT_GT(timing.min_exposure.count(), 0);
  EXPECT_LE(timing.min_exposure, timing.max_exposure);
  EXPECT_GE(timing.readout.count(), 0);
  if (camera.dead() != nullptr) {
    EXPECT_EQ(camera.dead()->grid(), camera.grid());
  }
  EXPECT_FALSE(camera.describe().empty());
  EXPECT_EQ(camera.describe().find('\n'), std::string::npos) << "one line for reports";
}

/// Frames have the camera's size, come in order, and come once.
inline void expect_camera_laws(Camera& camera, const std::function<void(std::size_t)>& expose) {
  expect_camera_facts(camera);
  const auto none = camera.take(0, Nanoseconds{0});
  ASSERT_TRUE(none.ok()) << none.error().line();
  EXPECT_TRUE(none->empty()) << "nothing was exposed";

  constexpr std::size_t kFrames = 3;
  constexpr Nanoseconds kPatience{20'000'000'000};  // ends a broken test, decides nothing
  const std::size_t values = static_cast<std::size_t>(camera.grid().rows) *
                             static_cast<std::size_t>(camera.grid().cols) *
                             static_cast<std::size_t>(camera.channels());
  expose(kFrames);
  const auto frames = camera.take(kFrames, kPatience);
  ASSERT_TRUE(frames.ok()) << frames.error().line();
  ASSERT_EQ(frames->size(), kFrames);
  for (std::size_t i = 0; i < kFrames; ++i) {
    const CameraFrame& frame = (*frames)[i];
    EXPECT_EQ(frame.raw.size(), values) << i;
    EXPECT_FALSE(frame.damaged) << i;
    if (i == 0) continue;
    EXPECT_GT(frame.sequence, (*frames)[i - 1].sequence);
    EXPECT_GE(frame.stamp, (*frames)[i - 1].stamp);
  }
  const auto again = camera.take(0, Nanoseconds{0});
  ASSERT_TRUE(again.ok()) << again.error().line();
  EXPECT_TRUE(again->empty()) << "a frame is handed over once";
}

}  // namespace symrig
