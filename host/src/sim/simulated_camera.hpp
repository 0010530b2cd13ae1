// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/camera/camera.hpp"

#include <functional>
#include <span>

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

}  // namespace symrig::sim
