// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/hdr/scene_sensor.hpp"
#include "symrig/rig/frame_taker.hpp"

#include <cstdint>
#include <functional>
#include <span>

namespace symrig {

/// Takes the frames that SceneTransfer needs, one pair after the other.
struct SceneSink {
  std::function<Result<void>(const SceneLevel& level)> begin;
  std::function<Result<void>(std::span<const std::uint16_t> first, std::span<const std::uint16_t> second)>
      pair;
};

struct SensorFramesOptions {
  double gain_error = 0.006;       ///< wanted relative error, one sigma
  double read_noise_error = 0.01;  ///< the same
  Progress progress;               ///< counts frames
};

/// Measures how bright the flood-lit scene is, then takes: dark frames at the shortest exposure; two at each
/// of two longer ones; pairs of the flood-lit scene at exposures that put its bright parts at a tenth to two
/// thirds of the range; a pair that saturates, if the camera can expose so long; and the first lit level
/// again. Bright parts: what a hundredth of the pixels exceeds. The number of pairs is that of
/// frames_needed().
/// fails: limit (the scene is too bright or too dark), device_refused (the picture does not follow the
/// exposure), interrupted; as FrameTaker::take() and the sink.
Result<void> take_sensor_frames(FrameTaker& rig, const SceneSink& sink,
                                const SensorFramesOptions& options = {});

}  // namespace symrig
