// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/simulated_projector.hpp"

#include <cstdint>
#include <vector>

namespace symrig::sim {

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
