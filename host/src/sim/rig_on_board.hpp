// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/sim_board.hpp"
#include "symrig/rig/rig.hpp"

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig::sim {

/// What simulated rigs share: a board in virtual time, and the rig that it fires. Interface: VirtualRig or
/// SimulatedPairs. The devices are the derived class's.
template <class Interface>
class RigOnBoard : public Interface {
 public:
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) final {
    return rig_->measure(patterns);
  }
  bool plans_exposures(std::size_t photographs) const final { return rig_->plans_exposures(photographs); }
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) final {
    return rig_->measure_expected(patterns, expected);
  }
  std::size_t together() const final { return std::max<std::size_t>(4, rig_->together()); }
  std::string describe() const final { return rig_->describe(); }
  const Rig& rig() const final { return *rig_; }

 protected:
  explicit RigOnBoard(std::unique_ptr<board_sim::SimBoard> board) : board_(std::move(board)) {}
  /// To be called by the derived destructor, while the devices still live.
  void end() {
    rig_.reset();    // uses the board
    board_.reset();  // uses its peripherals
  }

  /// Noise and drift go on where the earlier run of symrig ended: skip(photographs) makes the devices do so.
  template <class Skip>
  Result<void> pass_over(const ProbeCost& spent, const Skip& skip) {
    const std::int64_t missing = spent.photographs - rig_->cost().photographs;
    if (missing < 0)
      return Error{ErrorCode::bad_argument,
                   "this rig has taken more photographs than the capture to continue", "open the rig again"};
    return rig_->pass_over(missing, skip);
  }

  std::unique_ptr<board_sim::SimBoard> board_;
  std::unique_ptr<Rig> rig_;
};

}  // namespace symrig::sim
