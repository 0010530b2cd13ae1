// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/projector/projector.hpp"

#include <cstdint>
#include <vector>

namespace symrig::sim {

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

}  // namespace symrig::sim
