// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig.hpp"
#include "symrig/base/result.hpp"

#include <string>

namespace symrig::apps {

/// `symrig calibrate --rig` of a camera with pixels of its own.
struct RegistrationJob {
  std::string output, report, json;  ///< files to write; empty: none
};

/// Registers the rig's camera, writes the files, and prints the result.
/// fails: as register_camera and save_registration.
Result<void> register_rig(Probe& rig, const RegistrationJob& job);

}  // namespace symrig::apps
