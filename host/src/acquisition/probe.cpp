// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/probe.hpp"

#include <fmt/format.h>

namespace symrig {

Result<void> check_aligned(const Probe& probe) {
  if (probe.grid() == probe.camera_grid()) return {};
  return Error{ErrorCode::size_mismatch,
               fmt::format("the projector shows {} cells, but the camera has {} pixels",
                           to_string(probe.grid()), to_string(probe.camera_grid())),
               "register the camera: symrig calibrate --rig RIG -o registration.h5, then --registration"};
}

}  // namespace symrig
