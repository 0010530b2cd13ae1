// SPDX-License-Identifier: Apache-2.0
// Devices that a rig may close and open again, while the simulated ones behind them live on.
#pragma once

#include "symrig/boards/sim_board.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/projector/projector.hpp"
#include "symrig/rig/rig.hpp"

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig::sim {

/// Forwards to a camera that it does not own.
class BorrowedCamera final : public Camera {
 public:
  explicit BorrowedCamera(Camera& camera) : camera_(camera) {}
  Grid grid() const override { return camera_.grid(); }
  int channels() const override { return camera_.channels(); }
  CameraTiming timing() const override { return camera_.timing(); }
  const NoiseModel& noise() const override { return camera_.noise(); }
  const Image<std::uint8_t>* dead() const override { return camera_.dead(); }
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) override {
    return camera_.take(count, patience);
  }
  std::string describe() const override { return camera_.describe(); }

 private:
  Camera& camera_;
};

/// Forwards to a projector that it does not own.
class BorrowedProjector final : public Projector {
 public:
  explicit BorrowedProjector(Projector& projector) : projector_(projector) {}
  Grid grid() const override { return projector_.grid(); }
  Nanoseconds refresh_period() const override { return projector_.refresh_period(); }
  Pacing pacing() const override { return projector_.pacing(); }
  Result<void> load(std::span<const Pattern> patterns) override { return projector_.load(patterns); }
  Result<Shown> show(std::size_t index) override { return projector_.show(index); }
  PlaneTiming planes() const override { return projector_.planes(); }
  Result<void> load_planes(std::span<const Pattern> patterns, std::span<const PlanePlan> plans) override {
    return projector_.load_planes(patterns, plans);
  }
  Result<Shown> play(std::span<const std::size_t> order) override { return projector_.play(order); }
  Result<std::vector<ShownPicture>> played() override { return projector_.played(); }
  std::string setting_for_planes(std::span<const int> seen) const override {
    return projector_.setting_for_planes(seen);
  }
  Result<void> check() override { return projector_.check(); }
  std::string describe() const override { return projector_.describe(); }

 private:
  Projector& projector_;
};

/// What simulated rigs share: a board in virtual time, and the rig that it fires. Interface: VirtualRig or
/// SimulatedPairs. The devices are the derived class's.
template <class Interface>
class RigOnBoard : public Interface {
 public:
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) final {
    return rig_->measure(patterns);
  }
  bool plans_exposures(std::size_t photographs) const final { return rig_->plans_exposures(photographs); }
  bool held_short() const final { return rig_->held_short(); }
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
