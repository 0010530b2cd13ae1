// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlpc350/video_patterns.hpp"
#include "symrig/projector/drm_projector.hpp"

#include <memory>
#include <string>
#include <vector>

namespace symrig::projector::dlpc350 {

struct Dlpc350Options {
  DrmProjectorOptions screen;  ///< the screen whose cable feeds the controller
  VideoPatternOptions sequence;
  int latency = 1;  ///< refreshes from the scan-out of a picture to its planes
};

/// A screen of this computer whose pictures a DLPC350 splits into bit planes.
///
/// The screen is taken first and is black. Then the controller is configured. At the end, the controller gets
/// back its earlier state before the screen does.
class Dlpc350Projector final : public Projector {
 public:
  /// fails: as DrmProjector::open() and VideoPatterns::begin(); device_refused also if the screen does not
  /// count refreshes.
  static Result<std::unique_ptr<Dlpc350Projector>> open(std::unique_ptr<DrmProjector> screen,
                                                        Controller controller, const Dlpc350Options& options);

  Grid grid() const override { return screen_->grid(); }
  Nanoseconds refresh_period() const override { return screen_->refresh_period(); }
  Pacing pacing() const override { return Pacing::host; }
  /// Each pattern in a picture of its own. Grey becomes bright planes.
  Result<void> load(std::span<const Pattern> patterns) override;
  PlaneTiming planes() const override;
  Result<void> load_planes(std::span<const Pattern> patterns, std::span<const PlanePlan> plans) override;
  Result<Shown> show(std::size_t index) override { return screen_->show(index); }
  Result<Shown> play(std::span<const std::size_t> order) override { return screen_->play(order); }
  Result<std::vector<ShownPicture>> played() override { return screen_->played(); }
  Result<void> check() override { return sequence_->check(); }
  std::string describe() const override;

 private:
  Dlpc350Projector(std::unique_ptr<DrmProjector> screen, std::unique_ptr<VideoPatterns> sequence,
                   const Dlpc350Options& options);

  std::unique_ptr<DrmProjector> screen_;
  std::unique_ptr<VideoPatterns> sequence_;  // destroyed before the screen
  std::vector<int> bits_;
  Nanoseconds frame_lead_;
  int latency_;
};

}  // namespace symrig::projector::dlpc350
