// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <string>

namespace symrig::apps {

/// `symrig calibrate --rig RIG --levels FILE`: how the rig's projector turns levels into light.
struct LevelCalibration {
  std::string rig;
  std::string output;  ///< levels.toml
  std::string json;
};

/// fails: as open_rig and ProjectorResponse::fit; bad_argument (the rig corrects its levels already).
Result<void> calibrate_levels(const LevelCalibration& asked);

}  // namespace symrig::apps
