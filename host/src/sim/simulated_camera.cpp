// SPDX-License-Identifier: Apache-2.0
#include "sim/simulated_camera.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::sim {

SimulatedCamera::SimulatedCamera(SimulatedCameraSpec spec, board_sim::SimCamera& shutter, Develop develop)
    : spec_(std::move(spec)), shutter_(shutter), develop_(std::move(develop)) {}

/// In virtual time all frames of a run exist when it has ended, so there is no wait.
Result<std::vector<CameraFrame>> SimulatedCamera::take(std::size_t /*count*/, Nanoseconds /*patience*/) {
  const auto& frames = shutter_.frames();
  std::vector<SimulatedExposure> exposures;
  for (std::size_t i = 0; i < frames.size(); ++i)
    exposures.push_back({taken_ + i, frames[i].begin, frames[i].end});
  taken_ += frames.size();
  shutter_.reset();
  if (exposures.empty()) return std::vector<CameraFrame>{};
  SYMRIG_TRY(auto developed, develop_(exposures));
  if (spec_.tick_hz == 0) return developed;
  for (std::size_t i = 0; i < developed.size() && i < exposures.size(); ++i) {
    developed[i].stamp = {TickRate{spec_.tick_hz}.nanoseconds({exposures[i].end})};
    developed[i].stamp_of = StampOf::exposure_end;
  }
  return developed;
}

std::string SimulatedCamera::describe() const {
  return fmt::format("simulated camera {} x {}, {}", to_string(spec_.grid), spec_.channels,
                     spec_.noise.to_string());
}

}  // namespace symrig::sim
