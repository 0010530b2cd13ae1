// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/placement.hpp"
#include "symrig/projector/projector.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

namespace projector::drm {
class Cards;
class Screen;
}  // namespace projector::drm

/// Which screen, and how patterns lie on it.
struct DrmProjectorOptions {
  std::string connector;  ///< "card0-HDMI-A-1", "HDMI-A-1"; empty: the only one that is plugged in
  std::string mode;       ///< "1920x1080@60", "912x1140R" (computed); empty: the display's preferred one
  Placement placement;
  std::optional<Grid> grid;  ///< of the patterns; none: as many cells as fit
  CodeTable codes;
  int buffers = 3;      ///< 3: the next pattern is drawn while one is waited for; 2: where memory is short
  bool legacy = false;  ///< without atomic commits, even where the driver has them
  Nanoseconds patience{3'000'000'000};  ///< for a refresh
};

/// A projector that is a screen of this machine, driven through the kernel (DRM/KMS) without a desktop.
///
/// From open() until it is destroyed the screen is ours: in the mode asked for, black at first, never
/// blanked, cursor and overlays off, everything between memory and wire set to identity (tables, matrices,
/// scalers, RGB range, dithering, rotation) and read back. Then it is as it was before. If the process is
/// killed, the kernel puts its text console there; properties of the connector stay as we set them.
class DrmProjector final : public Projector {
 public:
  /// fails: unknown_name, bad_argument (no such connector or mode, or not clear which), device_refused (a
  /// desktop holds the card, or it cannot show pictures as they are), device_lost (nothing plugged in, no
  /// permission), size_mismatch (the patterns do not fit), limit (memory of the card).
  static Result<std::unique_ptr<DrmProjector>> open(const DrmProjectorOptions& options);
  /// The same on other cards than this machine's.
  static Result<std::unique_ptr<DrmProjector>> open(projector::drm::Cards& cards,
                                                    const DrmProjectorOptions& options);
  ~DrmProjector() override;

  Grid grid() const override { return grid_; }
  Nanoseconds refresh_period() const override;
  Pacing pacing() const override { return Pacing::host; }
  /// fails: size_mismatch, bad_value (a pattern leaves [0, 1]). What is on the screen stays there.
  Result<void> load(std::span<const Pattern> patterns) override;
  /// Also fails: timeout (no refresh came), limit, device_refused. After any of these and device_lost every
  /// call fails with the same again: destroy this one and open another.
  Result<Shown> show(std::size_t index) override;
  std::string describe() const override;

  Grid screen() const;
  /// Does the display count refreshes (Shown::counted)?
  bool counts_refreshes() const;
  /// What could not be set to identity and may matter, each a line.
  const std::vector<std::string>& warnings() const;

 private:
  DrmProjector(std::unique_ptr<projector::drm::Screen> screen, const DrmProjectorOptions& options, Grid grid);
  Result<Shown> flip_to(std::size_t index);
  std::size_t buffer_with(std::size_t index);
  void draw_ahead(std::size_t index, std::size_t waiting);

  std::unique_ptr<projector::drm::Screen> screen_;
  Placement placement_;
  CodeTable table_;
  Grid grid_;
  std::vector<Image<std::uint8_t>> codes_;
  std::vector<std::optional<std::size_t>> drawn_;  // which pattern each buffer holds
  std::size_t front_ = 0;                          // the buffer on the screen
  std::optional<Error> lost_;
};

}  // namespace symrig
