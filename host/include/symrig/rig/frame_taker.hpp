// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/hdr/sensor.hpp"
#include "symrig/rig/rig.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// The openers of a rig's devices, and how it takes frames.
struct RigParts {
  RigDevices devices;
  RigOptions options;
};

/// Frames as the camera delivered them, with the exposure times that the board measured.
struct RawFrames {
  std::vector<CameraFrame> frames;
  std::vector<Nanoseconds> exposures;
};

/// Takes frames with a board, a projector and a camera, as a Rig does, but neither meters nor merges. So it
/// needs to know nothing of the sensor. Every frame is certain (CameraLedger).
class FrameTaker {
 public:
  /// Opens the devices, and configures the board.
  /// fails: as Rig::open() without its metering.
  static Result<std::unique_ptr<FrameTaker>> open(RigParts parts);
  ~FrameTaker();
  FrameTaker(const FrameTaker&) = delete;
  FrameTaker& operator=(const FrameTaker&) = delete;

  /// Takes frames of one pattern, one directly after the other. The camera's answer is checked: each frame
  /// has one code for each pixel.
  /// fails: as Rig::measure(); bad_argument (the camera gives no codes, or several channels).
  Result<RawFrames> take(const Pattern& pattern, const Exposures& exposures);

  Grid grid() const;         ///< of patterns
  Grid camera_grid() const;  ///< of frames
  int bits() const;          ///< of a code
  /// The shortest exposure of camera and projector together; the longest one.
  Nanoseconds shortest() const;
  Nanoseconds longest() const;
  /// The nearest exposure that the rig can keep: whole ticks of the board, or whole periods of the
  /// projector's light.
  Nanoseconds possible(Nanoseconds exposure) const;
  const RigTrouble& trouble() const;
  std::int64_t frames() const;  ///< exposures that the camera made
  double rig_seconds() const;   ///< run time of the board's programs

 private:
  explicit FrameTaker(RigOptions options);

  RigOptions options_;
  std::unique_ptr<BracketTaker> taker_;  // uses options_
  CameraTiming timing_;
};

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
