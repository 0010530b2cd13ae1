// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/driver.hpp"

namespace symrig::projector {

std::unique_ptr<ProjectorSource> read_drm_projector(base::TableReader& table);

/// Projectors that are screens of this computer.
constexpr ProjectorDriver drm_driver() {
  return {"drm", "a screen of this computer", "", read_drm_projector};
}

}  // namespace symrig::projector
