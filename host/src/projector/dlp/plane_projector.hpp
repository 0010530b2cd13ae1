// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/plane_order.hpp"
#include "projector/dlp/plane_sequence.hpp"
#include "projector/dlp/signal.hpp"
#include "symrig/projector/drm_projector.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace symrig::projector::dlp {

/// How the planes of a screen's pictures come.
struct PlaneProjectorOptions {
  Nanoseconds frame_lead{20'000};  ///< from the frame trigger to the trigger of plane 0
  int latency = 1;                 ///< refreshes from the scan-out of a picture to its planes
  PlaneOrder order;
};

/// A screen of this computer whose pictures a DLP controller splits into bit planes.
///
/// The screen is taken first and is black. Then the controller is configured. At the end, the controller gets
/// back its earlier state before the screen does.
class PlaneProjector final : public Projector {
 public:
  /// Configures a controller for the pictures of the source, and starts its sequence.
  using Begin = std::function<Result<std::unique_ptr<PlaneSequence>>(const PictureSource& source)>;

  /// fails: as `begin`; device_refused also if the screen does not count refreshes.
  static Result<std::unique_ptr<PlaneProjector>> open(std::unique_ptr<DrmProjector> screen,
                                                      const PlaneProjectorOptions& options,
                                                      const Begin& begin);

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
  std::string setting_for_planes(std::span<const int> seen) const override {
    return order_setting(bits_, seen);
  }
  /// Of the screen and of the controller.
  std::vector<std::string> warnings() const override;
  std::string describe() const override;

 private:
  PlaneProjector(std::unique_ptr<DrmProjector> screen, std::unique_ptr<PlaneSequence> sequence,
                 const PlaneProjectorOptions& options);

  std::unique_ptr<DrmProjector> screen_;
  std::unique_ptr<PlaneSequence> sequence_;  // destroyed before the screen
  PlaneProjectorOptions options_;
  std::vector<int> bits_;
};

}  // namespace symrig::projector::dlp
