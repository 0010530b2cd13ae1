// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/projector/projector.hpp"

#include <cstdint>
#include <vector>

namespace symrig::sim {

/// The picture side of board_sim::SimProjector, which keeps the time: which pattern was on the screen when.
class SimulatedProjector final : public Projector {
 public:
  /// raster must outlive the projector.
  SimulatedProjector(Grid grid, board_sim::SimProjector& raster, Nanoseconds refresh_period);
  /// From now on a host shows the patterns: Pacing::host. board must outlive the projector.
  void be_shown_by_host(board_sim::SimBoard& board) { host_board_ = &board; }

  Grid grid() const override { return grid_; }
  Nanoseconds refresh_period() const override { return refresh_period_; }
  Pacing pacing() const override { return host_board_ == nullptr ? Pacing::trigger : Pacing::host; }
  Result<void> load(std::span<const Pattern> patterns) override;
  Result<Shown> show(std::size_t index) override;
  std::string describe() const override;

  /// A pattern of the sequence that was lit for a share of an exposure.
  struct Lit {
    std::size_t index;
    double share;
    bool operator==(const Lit&) const = default;
  };
  /// What the screen showed during [begin, end) of the board's ticks. Shares add up to 1, or to less if the
  /// screen was dark before the first pattern or after the last one.
  std::vector<Lit> shown(std::uint64_t begin, std::uint64_t end) const;
  const Pattern& pattern(std::size_t index) const { return sequence_[index]; }
  /// Patterns of the sequences loaded before this one: pattern(i) is the (loaded_before() + i)-th of all.
  std::uint64_t loaded_before() const { return loaded_before_; }
  /// The place of a pattern among all dark ones, or among all others, since the projector was switched on.
  /// The dark ones may come at another time when a capture is continued; the others come in the same order.
  struct Place {
    bool dark;
    std::uint64_t number;
  };
  Place place(std::size_t index) const { return places_[index]; }
  /// Counts `patterns`, none of them dark, that it never showed: those of a session before this one.
  void skip(std::uint64_t patterns) {
    loaded_before_ += patterns;
    lit_ += patterns;
  }

 private:
  Grid grid_;
  board_sim::SimProjector& raster_;
  board_sim::SimBoard* host_board_ = nullptr;
  Nanoseconds refresh_period_;
  std::vector<Pattern> sequence_;
  std::vector<Place> places_;
  std::uint64_t loaded_before_ = 0;
  std::uint64_t lit_ = 0, dark_ = 0;
};

}  // namespace symrig::sim
