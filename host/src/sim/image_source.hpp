// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/image_formation.hpp"
#include "sim/simulated_devices.hpp"
#include "sim/view.hpp"
#include "symrig/base/result.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/image/grid.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace symrig::sim {

/// A pattern that lit exposures. shown_before: number of patterns shown before it.
struct LitPattern {
  const Pattern* pattern = nullptr;
  std::uint64_t shown_before = 0;
};

/// What a simulated camera saw while its shutter was open.
struct LitExposure {
  struct Share {
    std::uint32_t pattern = 0;  ///< index in the patterns
    double share = 0;           ///< of the exposure
  };
  std::vector<Share> shares;
  double seconds = 0;
  std::uint64_t noise = 0;  ///< key of its noise: equal keys give equal codes
};

/// Turns the light of exposures into frames, in this process or behind a socket.
class ImageSource {
 public:
  ImageSource() = default;
  ImageSource(const ImageSource&) = delete;
  ImageSource& operator=(const ImageSource&) = delete;
  virtual ~ImageSource() = default;

  /// Gets ready, at first and after a failure. fails: device errors.
  virtual Result<void> open() { return {}; }
  /// One frame for each exposure, with its codes, or with its light if the camera has no noise.
  /// fails: device errors.
  virtual Result<std::vector<CameraFrame>> develop(std::span<const LitPattern> patterns,
                                                   std::span<const LitExposure> exposures) = 0;
};

/// Computes the part of the pictures in one tile of the camera's grid, from the whole scene.
class LocalImages final : public ImageSource {
 public:
  /// view must outlive this.
  LocalImages(const SceneUri& uri, const CameraView& view, const Tile& tile);
  Result<std::vector<CameraFrame>> develop(std::span<const LitPattern> patterns,
                                           std::span<const LitExposure> exposures) override;

 private:
  CameraFrame frame(const LitExposure& exposure, std::span<const ImageFormation::Light> lights) const;

  bool noisy_;
  ImageFormation formation_;
  Grid camera_;
  Tile tile_;
};

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
