// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/internal/dlp.hpp"
#include "symrig/projector/internal/drm_projector.hpp"
#include "symrig/projector/projector.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::projector {

/// Packs binary patterns into pictures of words 0x00RRGGBB: plane k of a picture is the bit bits[k] of each
/// word. Planes without a pattern are black. fails: size_mismatch, bad_value, bad_argument (as
/// Projector::load_planes).
Result<std::vector<Image<std::uint32_t>>> pack_planes(std::span<const Pattern> patterns,
                                                      std::span<const PlanePlan> plans, Grid grid,
                                                      std::span<const int> bits);

/// One picture for each pattern: a value v lights the first round(v·n) of n planes. Only exposures of whole
/// refreshes show it as grey.
/// fails: size_mismatch, bad_value (outside [0, 1] or NaN).
Result<std::vector<Image<std::uint32_t>>> spread_over_planes(std::span<const Pattern> patterns, Grid grid,
                                                             std::span<const int> bits);

}  // namespace symrig::projector

namespace symrig::projector::dlp {

/// In which order a controller shows the bits of a picture's words 0x00RRGGBB.
struct PlaneOrder {
  std::array<char, 3> colours{'G', 'R', 'B'};
  bool highest_first = false;  ///< of each colour: from its highest bit

  bool operator==(const PlaneOrder&) const = default;
  /// The bit of a word that is plane 0, 1, … of a picture.
  std::vector<int> bits(int planes) const;
};

/// "GRB", "GRB highest first".
std::string to_string(const PlaneOrder& order);
/// None: not such a text.
std::optional<PlaneOrder> parse_plane_order(std::string_view text);
/// The order whose first planes are these bits. None: no such order.
std::optional<PlaneOrder> order_of_bits(std::span<const int> bits);
/// The key of a rig file with which plane k has the bit that is now plane seen[k]. Empty: no order does that.
std::string order_setting(std::span<const int> bits, std::span<const int> seen);

/// Bit planes of a 24-bit picture.
inline constexpr int kMostPlanes = 24;

/// What a sequence of bit planes shall be, with any controller.
struct PlaneOptions {
  int planes = kMostPlanes;                  ///< in each picture
  std::optional<std::uint32_t> period_us;    ///< from plane to plane; none: the longest that fits
  std::optional<std::uint32_t> exposure_us;  ///< none: the period
  std::uint8_t leds = kAllLeds;
  std::optional<LedCurrents> led_currents;              ///< none: as they are
  bool plane_inverted = false, frame_inverted = false;  ///< the trigger outputs are active low
  Nanoseconds plane_delay{0};                           ///< of the plane trigger against its plane
  /// Of the frame trigger against the first plane. It comes before the first edge of the plane trigger, so
  /// that the order of the two is certain.
  Nanoseconds frame_delay{-20'000};
  Nanoseconds lock_patience{5'000'000'000};  ///< longest wait until the controller has locked to the signal
};

/// A sequence of 1-bit patterns: a plane of the picture each.
struct Sequence {
  int planes = kMostPlanes;
  std::uint32_t exposure_us = 0;
  std::uint32_t period_us = 0;  ///< from plane to plane
  std::uint8_t leds = kAllLeds;
};

/// The least times of a controller, in microseconds.
struct PlaneLimits {
  std::uint32_t exposure;  ///< of a 1-bit pattern
  /// Of the black after the last plane, and of a period that is longer than its exposure.
  std::uint32_t load;
};

/// The longest period for `planes` planes in a refresh. It leaves room for the black after the last plane,
/// and for a source that is 0.1 % too fast. fails: limit (the planes do not fit).
Result<std::uint32_t> longest_period(int planes, Nanoseconds refresh, const PlaneLimits& limits);

/// What the controller would refuse, and what it would not notice: planes that do not fit into a refresh of
/// the source. fails: bad_argument, limit; the message names the nearest legal value.
Result<void> check_sequence(const Sequence& sequence, Nanoseconds refresh, const PlaneLimits& limits);

/// The sequence that the options ask for. fails: as check_sequence().
Result<Sequence> sequence_of(const PlaneOptions& options, Nanoseconds refresh, const PlaneLimits& limits);

/// A controller that splits each picture of its video port into bit planes, until this object is destroyed.
class PlaneSequence {
 public:
  PlaneSequence() = default;
  PlaneSequence(const PlaneSequence&) = delete;
  PlaneSequence& operator=(const PlaneSequence&) = delete;
  virtual ~PlaneSequence() = default;

  virtual const Sequence& sequence() const = 0;
  virtual const std::string& name() const = 0;
  virtual Version version() const = 0;
  /// Checks that the sequence still runs. fails: device_lost (it was reset, or another program changed it),
  /// as Controller.
  virtual Result<void> check() = 0;
  /// What a user must know, one line each.
  virtual std::vector<std::string> warnings() const { return {}; }
};

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
