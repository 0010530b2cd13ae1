// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/image_source.hpp"
#include "sim/simulated_camera.hpp"
#include "sim/simulated_projector.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace symrig::sim {

/// Makes the frames of a simulated camera: which patterns lit each exposure, and the resulting codes.
class FrameMaker {
 public:
  /// planned: the exposures of each photograph are planned. projector must outlive this.
  FrameMaker(bool planned, std::shared_ptr<ImageSource> images, const SimulatedProjector& projector,
             double tick_seconds)
      : planned_(planned), images_(std::move(images)), projector_(projector), tick_seconds_(tick_seconds) {}

  /// fails: as ImageSource::develop.
  Result<std::vector<CameraFrame>> develop(std::span<const SimulatedExposure> exposures);
  double seconds() const { return seconds_; }

 private:
  std::vector<std::uint64_t> noise_keys(std::span<const SimulatedExposure> exposures);

  bool planned_;
  std::shared_ptr<ImageSource> images_;
  const SimulatedProjector& projector_;
  double tick_seconds_;
  double seconds_ = 0;
  std::optional<SimulatedProjector::Place> last_;  // the pattern of the newest frame
  std::uint64_t frames_of_last_ = 0;
};

}  // namespace symrig::sim
