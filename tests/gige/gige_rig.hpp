// SPDX-License-Identifier: Apache-2.0
// A whole rig in virtual time whose camera is the GigE Vision camera of this folder.
#pragma once

#include "gige/gige_camera.hpp"
#include "symrig/base/result.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace symrig::gige {

/// Board, projector and scene of a virtual rig. Its camera is a GigeCamera, which the driver of GenICam
/// cameras opens as a rig file would. The board's trigger line is the camera's. Each pulse is exposed to the
/// scene, and its picture goes over the network. Must outlive the rig that it opens.
class GigeRig final : public board_sim::Peripheral {
 public:
  /// keys: more lines of [camera].
  explicit GigeRig(CameraTraits traits = {}, std::string keys = {});

  /// fails: as open_virtual_rig() and GenicamCamera::open().
  Result<std::unique_ptr<VirtualRig>> open(const std::string& uri);

  /// Its devices without a rig, for a FrameTaker. The driver is told nothing of the sensor's noise.
  /// fails: as virtual_rig_parts().
  Result<RigParts> parts(const std::string& uri);

  GigeCamera& device() { return device_; }
  /// What the driver is told of the sensor's noise. Empty: that of the simulated sensor.
  std::optional<NoiseModel> noise;
  /// What goes wrong with the next pulse. Empty: nothing.
  std::function<Mishap()> mishap;
  /// Called after the rig's own options were set.
  std::function<void(RigOptions&)> options;
  std::uint64_t pulses() const { return pulses_; }
  /// The shortest time from the end of a pulse to the next one, so far.
  Nanoseconds shortest_gap() const { return shortest_gap_; }

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard& board) override;
  std::uint64_t next_event() const override {
    return waiting_.empty() ? board_sim::kNever : waiting_.front().end + delay_;
  }
  void on_event(std::uint64_t tick, board_sim::SimBoard& board) override;

 private:
  VirtualRigHooks hooks(bool knows_noise);
  Result<std::unique_ptr<Camera>> open_camera(Camera& simulated, bool knows_noise);
  void obey_nodes();
  void expose(std::uint64_t width, std::uint64_t end, std::uint64_t tick_hz);

  std::string keys_;
  CameraFrame picture_;          // what the next pulse shows
  Camera* simulated_ = nullptr;  // makes the pictures
  struct Pulse {
    std::uint64_t begin, end;
  };

  board_sim::SimBoard* board_ = nullptr;
  board_sim::SimCamera* shutter_ = nullptr;
  std::uint64_t delay_ = 0;    // ticks, by the camera's node
  std::deque<Pulse> waiting_;  // exposures that the delay keeps back
  bool high_ = false;
  std::uint64_t begin_ = 0, end_ = 0, pulses_ = 0;
  Nanoseconds shortest_gap_ = Nanoseconds::max();
  GigeCamera device_;  // last: its thread ends first
};

}  // namespace symrig::gige
