// SPDX-License-Identifier: Apache-2.0
#include "sim/simulated_camera.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::sim {

SimulatedCamera::SimulatedCamera(SimulatedCameraSpec spec, boards::SimCamera& shutter, Develop develop)
    : spec_(std::move(spec)), shutter_(shutter), develop_(std::move(develop)) {}

Result<std::vector<CameraFrame>> SimulatedCamera::take(std::size_t count) {
  const auto& frames = shutter_.frames();
  if (frames.size() < count)
    return Error{ErrorCode::frame_missing,
                 fmt::format("the camera exposed {} frames, {} were asked for; it missed {} triggers",
                             frames.size(), count, shutter_.missed_triggers()),
                 "leave more time for the readout between exposures"};
  std::vector<SimulatedExposure> exposures;
  for (std::size_t i = 0; i < frames.size(); ++i)
    exposures.push_back({taken_ + i, frames[i].begin, frames[i].end});
  taken_ += frames.size();
  shutter_.reset();
  return develop_(exposures);
}

std::string SimulatedCamera::describe() const {
  return fmt::format("simulated camera {} x {}, {}", to_string(spec_.grid), spec_.channels,
                     spec_.noise.to_string());
}

}  // namespace symrig::sim
