// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/projector/projector.hpp"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace symrig::sim {

/// The shutter was open during [begin, end) of the board's ticks.
struct SimulatedExposure {
  std::uint64_t sequence = 0;  ///< number of frames before it since the camera was switched on
  std::uint64_t begin = 0, end = 0;
};

/// The properties of a simulated camera.
struct SimulatedCameraSpec {
  Grid grid;
  int channels = 1;
  CameraTiming timing;
  NoiseModel noise;
  Image<std::uint8_t> dead;  ///< 1 = dead; empty: none
  /// Tick rate of the exposures, for the frames' stamps. 0: the camera has no clock.
  std::uint64_t tick_hz = 0;
};

/// The pictures of board_sim::SimCamera, which does the timing. The function Develop turns light into codes,
/// so this class does not depend on a scene.
class SimulatedCamera final : public Camera {
 public:
  /// Makes the frames of the given exposures, in the same order.
  using Develop = std::function<Result<std::vector<CameraFrame>>(std::span<const SimulatedExposure>)>;

  /// shutter must outlive the camera.
  SimulatedCamera(SimulatedCameraSpec spec, board_sim::SimCamera& shutter, Develop develop);

  Grid grid() const override { return spec_.grid; }
  int channels() const override { return spec_.channels; }
  CameraTiming timing() const override { return spec_.timing; }
  const NoiseModel& noise() const override { return spec_.noise; }
  const Image<std::uint8_t>* dead() const override { return spec_.dead.empty() ? nullptr : &spec_.dead; }
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override;
  std::string describe() const override;

  /// Counts `frames` exposures that it did not make: those of an earlier run of symrig.
  void skip(std::uint64_t frames) { taken_ += frames; }

 private:
  SimulatedCameraSpec spec_;
  board_sim::SimCamera& shutter_;
  Develop develop_;
  std::uint64_t taken_ = 0;
};

/// The pictures of board_sim::SimProjector, which does the timing: knows when each pattern was on the screen.
class SimulatedProjector : public Projector {
 public:
  /// raster must outlive the projector.
  SimulatedProjector(Grid grid, board_sim::SimProjector& raster, Nanoseconds refresh_period);
  /// From now on the host shows the patterns: Pacing::host. board must outlive the projector.
  void pace_by_host(board_sim::SimBoard& board) { host_board_ = &board; }

  Grid grid() const override { return grid_; }
  Nanoseconds refresh_period() const override { return refresh_period_; }
  Pacing pacing() const override { return host_board_ == nullptr ? Pacing::trigger : Pacing::host; }
  Result<void> load(std::span<const Pattern> patterns) override;
  Result<Shown> show(std::size_t index) override;
  std::string describe() const override;

  /// A pattern of the sequence, and the share of an exposure in which it was lit.
  struct Lit {
    std::size_t index;
    double share;
    bool operator==(const Lit&) const = default;
  };
  /// The patterns on the screen during [begin, end) of the board's ticks. The shares sum to 1, or to less if
  /// the screen was dark before the first pattern or after the last one.
  virtual std::vector<Lit> shown(std::uint64_t begin, std::uint64_t end) const;
  virtual const Pattern& pattern(std::size_t index) const { return sequence_[index]; }
  /// Number of patterns in earlier sequences: pattern(i) is number loaded_before() + i of all patterns.
  std::uint64_t loaded_before() const { return loaded_before_; }
  /// The number of a pattern among all dark patterns, or among all others, since the projector was switched
  /// on. When a capture continues, dark patterns may come at another time, but the others keep their order.
  struct Place {
    bool dark;
    std::uint64_t number;
    bool operator==(const Place&) const = default;
  };
  virtual Place place(std::size_t index) const { return places_[index]; }
  /// Counts `patterns`, none of them dark, that it did not show: those of an earlier run of symrig.
  void skip(std::uint64_t patterns) {
    loaded_before_ += patterns;
    lit_ += patterns;
  }

 protected:
  /// For a class that knows itself when a pattern was shown.
  SimulatedProjector(Grid grid, Nanoseconds refresh_period) : grid_(grid), refresh_period_(refresh_period) {}
  /// Checks a sequence, and keeps it with the places of its patterns.
  Result<void> keep(std::span<const Pattern> patterns);

 private:
  Grid grid_;
  board_sim::SimProjector* raster_ = nullptr;
  board_sim::SimBoard* host_board_ = nullptr;
  Nanoseconds refresh_period_;
  std::vector<Pattern> sequence_;
  std::vector<Place> places_;
  std::uint64_t loaded_before_ = 0;
  std::uint64_t lit_ = 0, dark_ = 0;
};

/// A screen whose pictures a DLP controller splits into bit planes. board_sim::SimPlaneProjector does the
/// timing.
///
/// The patterns are packed into pictures of RGB words as for a real screen. What the scene sees is read from
/// the bits of these words again, by the order that the controller's guide gives, and not from the plan.
class SimulatedPlaneProjector final : public SimulatedProjector {
 public:
  /// raster and board must outlive the projector.
  SimulatedPlaneProjector(Grid grid, board_sim::SimPlaneProjector& raster, board_sim::SimBoard& board,
                          const board_sim::SimPlaneProjectorConfig& config, Nanoseconds refresh_period);

  Pacing pacing() const override { return Pacing::host; }
  PlaneTiming planes() const override { return timing_; }
  Result<void> load(std::span<const Pattern> patterns) override;
  Result<void> load_planes(std::span<const Pattern> patterns, std::span<const PlanePlan> plans) override;
  Result<Shown> show(std::size_t index) override;
  Result<Shown> play(std::span<const std::size_t> order) override;
  Result<std::vector<ShownPicture>> played() override;
  std::string setting_for_planes(std::span<const int> seen) const override;
  std::string describe() const override;

  std::vector<Lit> shown(std::uint64_t begin, std::uint64_t end) const override;
  const Pattern& pattern(std::size_t index) const override { return seen_[index].pattern; }
  Place place(std::size_t index) const override { return seen_[index].place; }

 private:
  /// A plane as it leaves the projector.
  struct Seen {
    Pattern pattern;
    Place place;
  };
  void split(std::span<const PlanePlan> plans);
  Result<void> check_picture(std::size_t index) const;
  Shown shown_at(std::uint64_t refresh, std::uint64_t tick) const;

  board_sim::SimPlaneProjector& raster_;
  board_sim::SimBoard& board_;
  PlaneTiming timing_;
  std::vector<Image<std::uint32_t>> pictures_;
  std::vector<Seen> seen_;
  std::uint64_t unplanned_ = 0;                    // pictures so far
  std::vector<std::vector<std::size_t>> seen_of_;  // [picture][plane]: index in seen_
};

}  // namespace symrig::sim
