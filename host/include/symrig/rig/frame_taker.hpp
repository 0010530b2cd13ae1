// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/rig/rig.hpp"

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

}  // namespace symrig
