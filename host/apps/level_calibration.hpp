// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <string>

namespace symrig::apps {

/// `symrig calibrate --rig RIG --levels FILE`: measures the light of each level of the rig's projector.
struct LevelCalibration {
  std::string rig;
  std::string output;  ///< levels.toml
  std::string json;
};

/// fails: as open_rig and ProjectorResponse::fit; bad_argument (the rig file already corrects the levels).
Result<void> calibrate_levels(const LevelCalibration& asked);

}  // namespace symrig::apps
