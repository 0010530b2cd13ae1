// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/projector.hpp"

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

namespace symrig {

namespace projector::drm {
class Cards;
class Screen;
}  // namespace projector::drm

/// Which screen to use, and where patterns lie on it.
struct DrmProjectorOptions {
  std::string connector;  ///< "card0-HDMI-A-1", "HDMI-A-1"; empty: the only connected one
  std::string mode;       ///< "1920x1080@60", "912x1140R" (computed timings); empty: the display's preference
  Placement placement;
  std::optional<Grid> grid;  ///< of the patterns; none: as many whole cells as fit
  CodeTable codes;
  int buffers = 3;      ///< 3: draws the next pattern while waiting for a refresh; 2: needs less memory
  bool legacy = false;  ///< true: never uses atomic commits
  Nanoseconds patience{3'000'000'000};  ///< longest wait for a refresh
};

/// A projector that is a screen of this computer, driven through the kernel (DRM/KMS) without a desktop.
///
/// The object owns the screen from open() until it is destroyed. The screen shows the requested mode, is
/// black at first, and never blanks. Cursor and overlays are off. Everything between memory and cable is set
/// to identity (tables, matrices, scalers, RGB range, dithering, rotation) and read back. The destructor
/// restores the earlier state. If the process is killed, the kernel shows its text console, and the connector
/// keeps the properties that were set.
class DrmProjector final : public Projector {
 public:
  /// fails: unknown_name, bad_argument (no such connector or mode, or several match), device_refused (a
  /// desktop uses the card, or the card cannot show pictures unchanged), device_lost (nothing connected, no
  /// permission), size_mismatch (the patterns do not fit), limit (not enough memory on the card).
  static Result<std::unique_ptr<DrmProjector>> open(const DrmProjectorOptions& options);
  /// The same with other cards than this computer's, for tests.
  static Result<std::unique_ptr<DrmProjector>> open(projector::drm::Cards& cards,
                                                    const DrmProjectorOptions& options);
  ~DrmProjector() override;

  Grid grid() const override { return grid_; }
  Nanoseconds refresh_period() const override;
  Pacing pacing() const override { return Pacing::host; }
  /// fails: size_mismatch, bad_value (a pattern has values outside [0, 1]). The screen does not change.
  Result<void> load(std::span<const Pattern> patterns) override;
  /// Loads pictures of the patterns' grid as words 0x00RRGGBB. show() then counts pictures.
  /// fails: size_mismatch. The screen does not change.
  Result<void> load_words(std::vector<Image<std::uint32_t>> pictures);
  /// fails: also timeout (no refresh), limit, device_refused. After one of these or device_lost, every later
  /// call fails in the same way. Destroy this object and open a new one.
  Result<Shown> show(std::size_t index) override;
  /// Only if counts_refreshes(). A thread shows the pictures. It requests one in every refresh, also the same
  /// one again, so that every refresh has a count and a stamp. fails: as show(), and device_refused
  /// (refreshes are not counted).
  Result<Shown> play(std::span<const std::size_t> order) override;
  Result<std::vector<ShownPicture>> played() override;
  std::string describe() const override;

  Grid screen() const;
  /// true: the display counts refreshes (Shown::counted).
  bool counts_refreshes() const;
  /// Properties that could not be set to identity and may matter, one per line.
  std::vector<std::string> warnings() const override;

 private:
  DrmProjector(std::unique_ptr<projector::drm::Screen> screen, const DrmProjectorOptions& options, Grid grid);
  struct Playing;
  Result<void> check_loaded(std::span<const std::size_t> indices) const;
  Result<Shown> flip_to(std::size_t index);
  Result<Shown> flip(std::size_t index, std::size_t next);
  std::uint64_t next_refresh(const Shown& last) const;
  void keep_playing(Playing& playing, const std::stop_token& stop);
  std::size_t buffer_with(std::size_t index);
  void draw_ahead(std::size_t index, std::size_t waiting);
  void draw_into(std::size_t buffer, std::size_t index);
  std::size_t loaded() const { return words_.empty() ? codes_.size() : words_.size(); }

  std::unique_ptr<projector::drm::Screen> screen_;
  Placement placement_;
  CodeTable table_;
  Grid grid_;
  std::vector<Image<std::uint8_t>> codes_;
  std::vector<Image<std::uint32_t>> words_;        // instead of codes_, after load_words()
  std::vector<std::optional<std::size_t>> drawn_;  // the pattern in each buffer
  std::size_t front_ = 0;                          // the buffer that the screen shows
  std::optional<Error> lost_;
  std::unique_ptr<Playing> playing_;  // between play() and played()
};

}  // namespace symrig
